#include "renderer/scene/scene_hit.h"

#include "renderer/scene/scene_ellipse.h"

#include <math.h>
#include <string.h>

/* Puts a rounded hit onto the surface of a round segment (scene_faces.h). p: relative to the first end; normal: of any
 * length, which tells on which part of the surface the hit lies, and becomes the exact one. */
static void put_on_surface(const struct scene_vertex v[2], const float u[3], float length, float p[3], float normal[3])
{
    const float k = (v[1].radius - v[0].radius) / length,
                n2 = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2],
                beyond = (normal[0] * u[0] + normal[1] * u[1] + normal[2] * u[2]) / sqrtf(n2) + k;
    float foot = p[0] * u[0] + p[1] * u[1] + p[2] * u[2], cosine = sqrtf(fmaxf(1 - k * k, 0)), slope = k,
          radius = (v[0].radius + k * foot) / cosine, from[3], length2 = 0;
    if (fabsf(beyond) > 1e-3f) { /* on the ball around one of the ends */
        foot = beyond < 0 ? 0 : length;
        radius = v[beyond < 0 ? 0 : 1].radius;
        cosine = 1;
        slope = 0;
    }
    for (int a = 0; a < 3; a++) {
        from[a] = p[a] - foot * u[a];
        length2 += from[a] * from[a];
    }
    const float inv = 1 / sqrtf(length2);
    for (int a = 0; a < 3; a++) {
        from[a] *= inv;
        p[a] = foot * u[a] + radius * from[a];
        normal[a] = cosine * from[a] - slope * u[a];
    }
}

/* Moves the ray's frame to the copy of the tile that was hit, so that the segment has the coordinates of its vertices
 * there, and all that is computed from them is rounded once. */
static void move_to_copy(const struct scene *s, struct scene_ray *r, unsigned i_copy)
{
    const int side = 2 * s->half_block[0] + 1,
              copy[2] = {(int)i_copy % side - s->half_block[0], (int)i_copy / side - s->half_block[1]};
    for (int a = 0; a < 2; a++) {
        if (copy[a] == 0) continue;
        r->offset_mm[a] += copy[a] * s->tile_mm[a];
        r->origin_mm[a] = (float)((double)r->origin_mm[a] - copy[a] * s->tile_mm[a]);
    }
}

void scene_hit_fill(const struct scene *s, struct scene_ray *r, const struct RTCRayHit *q, struct scene_hit *hit)
{
    move_to_copy(s, r, q->hit.instID[0]);
    hit->i_segment = q->hit.primID;
    hit->n_inside = r->n_inside;
    hit->i_cell = 0;
    const struct scene_vertex *v = &s->vertex[s->segment_vertex[hit->i_segment]];
    const float u[3] = {v[1].x - v[0].x, v[1].y - v[0].y, v[1].z - v[0].z}, start[3] = {v[0].x, v[0].y, v[0].z},
                length = sqrtf(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]), inv = 1 / length;
    hit->normal[0] = q->hit.Ng_x;
    hit->normal[1] = q->hit.Ng_y;
    hit->normal[2] = q->hit.Ng_z;
    for (int a = 0; a < 3; a++) {
        hit->tangent[a] = u[a] * inv;
        hit->position_mm[a] = r->origin_mm[a] + q->ray.tfar * r->direction[a];
    }
    if (s->ellipse != NULL) {
        const float *n = hit->normal, inv_n = 1 / sqrtf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (int a = 0; a < 3; a++) hit->normal[a] *= inv_n;
        hit->radius_mm = s->ellipse[hit->i_segment].sharpest_mm;
        return;
    }
    float p[3];
    for (int a = 0; a < 3; a++) p[a] = hit->position_mm[a] - start[a];
    put_on_surface(v, hit->tangent, length, p, hit->normal);
    for (int a = 0; a < 3; a++) hit->position_mm[a] = start[a] + p[a];
    hit->radius_mm = v[0].radius + q->hit.u * (v[1].radius - v[0].radius);
}
