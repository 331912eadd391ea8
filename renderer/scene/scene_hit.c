#include "renderer/scene/scene_hit.h"

#include "renderer/scene/scene_ellipse.h"

#include <math.h>
#include <string.h>

/* The place on the surface of a round segment that is nearest to a point beside it, and the normal there. p: relative
 * to the first end; becomes exact. Returns the radius there. */
static float put_on_surface(const struct scene_vertex v[2], const float u[3], float length, float p[3], float normal[3])
{
    const float k = (v[1].radius - v[0].radius) / length, c2 = 1 - k * k,
                along = p[0] * u[0] + p[1] * u[1] + p[2] * u[2];
    float place = c2 > 0  ? (along + k * v[0].radius) / c2
                  : k < 0 ? 0
                          : length,
          from[3], length2 = 0; /* of the ball that touches there */
    place = fminf(fmaxf(place, 0), length);
    const float radius = v[0].radius + k * place;
    for (int a = 0; a < 3; a++) {
        from[a] = p[a] - place * u[a];
        length2 += from[a] * from[a];
    }
    const float inv = 1 / sqrtf(length2);
    for (int a = 0; a < 3; a++) {
        normal[a] = from[a] * inv;
        p[a] = place * u[a] + radius * normal[a];
    }
    return radius;
}

/* Moves the ray's frame to the copy of the tile that was hit, so that the segment has the coordinates of its vertices
 * there, and all that is computed from them is rounded once. */
static void move_to_copy(const struct scene *s, struct scene_ray *r, const int copy[2])
{
    for (int a = 0; a < 2; a++) {
        if (copy[a] == 0) continue;
        r->offset_mm[a] += copy[a] * s->tile_mm[a];
        r->origin_mm[a] = (float)((double)r->origin_mm[a] - copy[a] * s->tile_mm[a]);
    }
}

void scene_hit_fill(const struct scene *s, struct scene_ray *r, const struct scene_face *face, struct scene_hit *hit)
{
    move_to_copy(s, r, face->copy);
    hit->i_segment = face->i_segment;
    hit->i_cell = 0;
    const struct scene_vertex *v = &s->vertex[s->segment_vertex[hit->i_segment]];
    const float u[3] = {v[1].x - v[0].x, v[1].y - v[0].y, v[1].z - v[0].z}, start[3] = {v[0].x, v[0].y, v[0].z},
                length = sqrtf(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]), inv = 1 / length;
    for (int a = 0; a < 3; a++) {
        hit->tangent[a] = u[a] * inv;
        hit->position_mm[a] = r->origin_mm[a] + face->t * r->direction[a];
    }
    if (s->ellipse != NULL) {
        const float *n = face->normal, inv_n = 1 / sqrtf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (int a = 0; a < 3; a++) hit->normal[a] = n[a] * inv_n;
        hit->radius_mm = s->ellipse[hit->i_segment].sharpest_mm;
        return;
    }
    float p[3];
    for (int a = 0; a < 3; a++) p[a] = hit->position_mm[a] - start[a];
    hit->radius_mm = put_on_surface(v, hit->tangent, length, p, hit->normal);
    for (int a = 0; a < 3; a++) hit->position_mm[a] = start[a] + p[a];
}
