#include "renderer/scene/bent_scene.h"
#include "renderer/scene/scene_data.h"
#include "renderer/scene/scene_visitor.h"

#include <math.h>
#include <string.h>

bool scene_trace(const struct scene *s, struct scene_ray *r, struct scene_hit *hit)
{
    float distance;
    return s->bent != NULL ? bent_trace(s, r, hit) : scene_trace_span(s, r, INFINITY, hit, &distance);
}

bool scene_occluded(const struct scene *s, const struct scene_ray *ray)
{
    return s->bent != NULL ? bent_occluded(s, ray, NULL) : scene_occluded_span(s, ray, INFINITY, NULL);
}

bool scene_visit_ahead(const struct scene *s, const struct scene_ray *ray, scene_visit *visit, void *context)
{
    struct scene_visitor v;
    scene_visitor_init(&v, s, ray->direction, visit, context);
    return s->bent != NULL ? !bent_occluded(s, ray, &v) : !scene_occluded_span(s, ray, INFINITY, &v);
}

/* How far rays start from the surface that they leave: more than places are rounded by. */
static inline float skin_mm(const struct scene_hit *hit)
{
    const float *p = hit->position_mm;
    return 3e-5f * hit->radius_mm + 1.2e-7f * (fabsf(p[0]) + fabsf(p[1]) + fabsf(p[2]));
}

void scene_ray_leave(const struct scene_hit *hit, const double offset_mm[2], const float direction[3],
                     struct scene_ray *r)
{
    const float *n = hit->normal, *w = direction, skin = skin_mm(hit);
    const bool inwards = n[0] * w[0] + n[1] * w[1] + n[2] * w[2] < 0;
    for (int a = 0; a < 3; a++) r->origin_mm[a] = hit->position_mm[a] + (inwards ? -skin : skin) * n[a];
    memcpy(r->offset_mm, offset_mm, sizeof r->offset_mm);
    memcpy(r->direction, direction, sizeof r->direction);
    r->tnear_mm = 0;
    r->inside = true; /* fibers overlap where they touch */
    r->i_from = inwards ? hit->i_segment : SCENE_NO_SEGMENT;
    r->i_cell = hit->i_cell;
}

void scene_ray_leave_across(const struct scene_hit *hit, const double offset_mm[2], const float direction[3],
                            float place, struct scene_ray *r)
{
    const float *t = hit->tangent;
    float along = t[0] * direction[0] + t[1] * direction[1] + t[2] * direction[2], front[3], norm2 = 0;
    for (int a = 0; a < 3; a++) {
        front[a] = direction[a] - along * t[a];
        norm2 += front[a] * front[a];
    }
    const float skin = skin_mm(hit);
    float inv = norm2 > 0 ? 1 / sqrtf(norm2) : 0, across = 2 * place - 1, towards = sqrtf(1 - across * across);
    for (int a = 0; a < 3; a++) front[a] *= inv;
    const float side[3] = {t[1] * front[2] - t[2] * front[1], t[2] * front[0] - t[0] * front[2],
                           t[0] * front[1] - t[1] * front[0]};
    for (int a = 0; a < 3; a++) {
        float from_axis = across * side[a] + towards * front[a];
        r->origin_mm[a] = hit->position_mm[a] + hit->radius_mm * (from_axis - hit->normal[a]) + skin * from_axis;
    }
    memcpy(r->offset_mm, offset_mm, sizeof r->offset_mm);
    memcpy(r->direction, direction, sizeof r->direction);
    r->tnear_mm = 0;
    r->i_from = SCENE_NO_SEGMENT;
    r->inside = true; /* a fiber that bends or is overlapped may hold the place */
    r->i_cell = hit->i_cell;
}

bool scene_ray_enter(const struct scene *s, const double origin_mm[3], const double direction[3], struct scene_ray *r)
{
    if (s->bent != NULL) return bent_enter(s, origin_mm, direction, r);
    double top = (double)SCENE_MARGIN_MM, bottom = (double)(s->bottom_mm - SCENE_MARGIN_MM), z = origin_mm[2], t = 0;
    if (z > top) {
        if (direction[2] >= 0) return false;
        t = (top - z) / direction[2];
    } else if (z < bottom) {
        if (direction[2] <= 0) return false;
        t = (bottom - z) / direction[2];
    }
    for (int a = 0; a < 3; a++) {
        double p = origin_mm[a] + t * direction[a];
        if (a < 2) {
            r->offset_mm[a] = floor(p / s->tile_mm[a]) * s->tile_mm[a];
            p -= r->offset_mm[a];
        }
        r->origin_mm[a] = (float)p;
        r->direction[a] = (float)direction[a];
    }
    r->tnear_mm = 0;
    r->inside = false;
    r->i_from = SCENE_NO_SEGMENT;
    r->i_cell = 0;
    return true;
}
