/* Rays through the flat cloth: from block to block of its tiles. */
#include "renderer/scene/scene_embree.h"
#include "renderer/scene/scene_grid.h"
#include "renderer/scene/scene_hit.h"
#include "renderer/scene/scene_visitor.h"

#include <math.h>

/* Local origin into the centre tile. */
static inline void wrap(const struct scene *s, struct scene_ray *r)
{
    for (int a = 0; a < 2; a++) {
        float tile = (float)s->tile_mm[a];
        if (r->origin_mm[a] >= 0 && r->origin_mm[a] < tile) continue;
        double n = floor((double)r->origin_mm[a] / s->tile_mm[a]);
        r->offset_mm[a] += n * s->tile_mm[a];
        r->origin_mm[a] = (float)((double)r->origin_mm[a] - n * s->tile_mm[a]);
    }
}

/* Distance to where the ray leaves the slab (*leaves) or the covered part of the block, whichever comes first. */
static inline float reach(const struct scene *s, const struct scene_ray *r, bool *leaves)
{
    const float *o = r->origin_mm, *d = r->direction;
    float t = INFINITY;
    for (int a = 0; a < 2; a++) {
        float to = (d[a] > 0 ? s->inset_high_mm[a] : s->inset_low_mm[a]) - o[a];
        float t_edge = d[a] != 0 ? to / d[a] : INFINITY;
        t = t_edge < t ? t_edge : t;
    }
    float plane = d[2] > 0 ? SCENE_MARGIN_MM : s->bottom_mm - SCENE_MARGIN_MM;
    float t_slab = d[2] != 0 ? (plane - o[2]) / d[2] : INFINITY;
    *leaves = t_slab <= t;
    return *leaves ? t_slab : t;
}

static inline void advance(struct scene_ray *r, float t)
{
    for (int a = 0; a < 3; a++) r->origin_mm[a] += t * r->direction[a];
    r->tnear_mm = r->tnear_mm > t ? r->tnear_mm - t : 0;
}

bool scene_trace_span(const struct scene *s, struct scene_ray *r, float span, struct scene_hit *hit, float *distance)
{
    float left = span; /* from the ray's present origin */
    for (int i = 0; i < SCENE_MAX_WRAP; i++) {
        struct scene_face face;
        bool leaves;
        wrap(s, r);
        float t = reach(s, r, &leaves);
        if (left <= t) {
            t = left;
            leaves = true;
        }
        if (t > r->tnear_mm &&
            (s->grid != NULL ? scene_grid_trace(s, r, t, &face) : scene_embree_trace(s, r, t, &face))) {
            scene_hit_fill(s, r, &face, hit);
            *distance = span - left + face.t;
            return true;
        }
        if (leaves || !isfinite(t)) return false;
        advance(r, t);
        left -= t;
    }
    return false;
}

static inline bool occluded(const struct scene *s, const struct scene_ray *r, float t, struct scene_visitor *visitor)
{
    if (s->grid == NULL) return scene_embree_occluded(s, r, t, visitor);
    return visitor == NULL ? scene_grid_occluded(s, r, t) : scene_grid_visit(s, r, t, visitor);
}

bool scene_occluded_span(const struct scene *s, const struct scene_ray *ray, float span, struct scene_visitor *visitor)
{
    struct scene_ray r = *ray;
    for (int i = 0; i < SCENE_MAX_WRAP; i++) {
        bool leaves;
        wrap(s, &r);
        float t = reach(s, &r, &leaves);
        if (span <= t) {
            t = span;
            leaves = true;
        }
        if (t > r.tnear_mm && occluded(s, &r, t, visitor)) return true;
        if (leaves || !isfinite(t)) return false;
        advance(&r, t);
        span -= t;
    }
    return false;
}
