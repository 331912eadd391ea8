/* Rays through the flat cloth: from block to block of its tiles. */
#include "renderer/scene/scene_hit.h"

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

static inline void fill_ray(struct RTCRay *q, const struct scene_ray *r, float tfar)
{
    q->org_x = r->origin_mm[0];
    q->org_y = r->origin_mm[1];
    q->org_z = r->origin_mm[2];
    q->tnear = r->tnear_mm;
    q->dir_x = r->direction[0];
    q->dir_y = r->direction[1];
    q->dir_z = r->direction[2];
    q->time = 0;
    q->tfar = tfar;
    q->mask = ~0u;
    q->id = 0;
    q->flags = 0;
}

/* Whether the nearest face is met from inside: rounding has put the start of the ray into a fiber. */
static bool comes_out(const struct RTCRayHit *q)
{
    return q->ray.dir_x * q->hit.Ng_x + q->ray.dir_y * q->hit.Ng_y + q->ray.dir_z * q->hit.Ng_z > 0;
}

/* The nearest hit over *span of the ray; *span is what is left of it from the ray's final origin, from which q has its
 * distance. */
static bool trace_span(const struct scene *s, struct scene_ray *r, float *span, struct scene_faces *faces,
                       struct RTCRayHit *q)
{
    for (int i = 0; i < SCENE_MAX_WRAP; i++) {
        bool leaves;
        wrap(s, r);
        float t = reach(s, r, &leaves);
        if (*span <= t) {
            t = *span;
            leaves = true;
        }
        while (t > r->tnear_mm) {
            fill_ray(&q->ray, r, t);
            q->hit.geomID = q->hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
            faces->n_back = 0;
            rtcIntersect1(s->block, &faces->embree, q);
            const float nearest = q->hit.geomID != RTC_INVALID_GEOMETRY_ID ? q->ray.tfar : t;
            r->n_inside -= scene_faces_left(faces, nearest, r->n_inside);
            if (q->hit.geomID == RTC_INVALID_GEOMETRY_ID) break;
            if (!comes_out(q)) return true;
            r->tnear_mm = nearest * (1 + 1e-6f) + 1e-6f;
        }
        if (leaves || !isfinite(t)) return false;
        advance(r, t);
        *span -= t;
    }
    return false;
}

bool scene_trace_span(const struct scene *s, struct scene_ray *r, float span, struct scene_hit *hit, float *distance)
{
    struct RTCRayHit q;
    struct scene_faces faces;
    float left = span;
    scene_faces_init(&faces, s, r);
    if (!trace_span(s, r, &left, &faces, &q)) return false;
    scene_hit_fill(s, r, &q, hit);
    *distance = span - left + q.ray.tfar;
    return true;
}

/* Embree's filter of rays that visit fibers. */
static void visit_face(const struct RTCFilterFunctionNArguments *a)
{
    struct scene_visitor *v = (struct scene_visitor *)(void *)a->context;
    const struct RTCHit *hit = (const struct RTCHit *)a->hit; /* single rays: N is 1 */
    scene_faces_filter(a);
    if (a->valid[0] == 0) return;
    const struct scene *s = v->faces.flat;
    const struct scene_vertex *p = &s->vertex[s->segment_vertex[hit->primID]];
    const float flat[3] = {p[1].x - p[0].x, p[1].y - p[0].y, p[1].z - p[0].z};
    float along = 0, length2 = 0;
    for (int i = 0; i < 3; i++) {
        const float *row = v->to_seen[i];
        float t = v->to_seen[0] != NULL ? row[0] * flat[0] + row[1] * flat[1] + row[2] * flat[2] : flat[i];
        along += t * v->direction[i];
        length2 += t * t;
    }
    if (v->visit(v->context, hit->primID, along / sqrtf(length2)))
        a->valid[0] = 0; /* refused, so that Embree goes on looking */
    else
        v->stopped = true;
}

void scene_visitor_init(struct scene_visitor *v, const struct scene *flat, const float direction[3], scene_visit *visit,
                        void *context)
{
    scene_faces_init(&v->faces, flat, NULL);
    v->faces.embree.filter = visit_face;
    v->visit = visit;
    v->context = context;
    for (int a = 0; a < 3; a++) {
        v->direction[a] = direction[a];
        v->to_seen[a] = NULL;
    }
    v->stopped = false;
}

bool scene_occluded_span(const struct scene *s, const struct scene_ray *ray, float span, struct scene_visitor *visitor)
{
    struct scene_ray r = *ray;
    struct scene_faces plain, *faces = visitor != NULL ? &visitor->faces : &plain;
    if (visitor == NULL) scene_faces_init(&plain, s, &r);
    for (int i = 0; i < SCENE_MAX_WRAP; i++) {
        bool leaves;
        wrap(s, &r);
        float t = reach(s, &r, &leaves);
        if (span <= t) {
            t = span;
            leaves = true;
        }
        if (t > r.tnear_mm) {
            struct RTCRay q;
            fill_ray(&q, &r, t);
            rtcOccluded1(s->block, &faces->embree, &q);
            if (q.tfar < 0) return true;
        }
        if (leaves || !isfinite(t)) return false;
        advance(&r, t);
        span -= t;
    }
    return false;
}
