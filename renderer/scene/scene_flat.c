/* Rays through the flat cloth: from block to block of its tiles. */
#include "renderer/scene/scene_ellipse.h"

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

static void fill_hit(const struct scene *s, const struct scene_ray *r, const struct RTCRayHit *q, struct scene_hit *hit)
{
    for (int a = 0; a < 3; a++) hit->position_mm[a] = r->origin_mm[a] + q->ray.tfar * r->direction[a];
    float n[3] = {q->hit.Ng_x, q->hit.Ng_y, q->hit.Ng_z};
    float inv = 1 / sqrtf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int a = 0; a < 3; a++) hit->normal[a] = n[a] * inv;
    hit->i_segment = q->hit.primID;
    const struct scene_vertex *v = &s->vertex[s->segment_vertex[hit->i_segment]];
    float t[3] = {v[1].x - v[0].x, v[1].y - v[0].y, v[1].z - v[0].z};
    inv = 1 / sqrtf(t[0] * t[0] + t[1] * t[1] + t[2] * t[2]);
    for (int a = 0; a < 3; a++) hit->tangent[a] = t[a] * inv;
    hit->radius_mm = s->ellipse != NULL ? s->ellipse[hit->i_segment].sharpest_mm
                                        : v[0].radius + q->hit.u * (v[1].radius - v[0].radius);
    hit->i_cell = 0;
}

/* The nearest front face over *span of the ray; *span is what is left of it from the ray's final origin, from which q
 * has its distance. */
static bool trace_span(const struct scene *s, struct scene_ray *r, float *span, struct RTCRayHit *q)
{
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    for (int i = 0; i < SCENE_MAX_WRAP; i++) {
        bool leaves;
        wrap(s, r);
        float t = reach(s, r, &leaves);
        if (*span <= t) {
            t = *span;
            leaves = true;
        }
        if (t > r->tnear_mm) {
            fill_ray(&q->ray, r, t);
            q->hit.geomID = q->hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
            rtcIntersect1(s->block, &context, q);
            if (q->hit.geomID != RTC_INVALID_GEOMETRY_ID) return true;
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
    float left = span;
    if (!trace_span(s, r, &left, &q)) return false;
    fill_hit(s, r, &q, hit);
    *distance = span - left + q.ray.tfar;
    return true;
}

void scene_occlusion_filter(const struct RTCFilterFunctionNArguments *a)
{
    struct scene_visitor *v = (struct scene_visitor *)(void *)a->context;
    const struct RTCRay *ray = (const struct RTCRay *)a->ray; /* single rays: N is 1 */
    const struct RTCHit *hit = (const struct RTCHit *)a->hit;
    if (ray->dir_x * hit->Ng_x + ray->dir_y * hit->Ng_y + ray->dir_z * hit->Ng_z > 0) { /* a back face */
        a->valid[0] = 0;
        return;
    }
    if (v->visit == NULL) return;
    const struct scene_vertex *p = &v->flat->vertex[v->flat->segment_vertex[hit->primID]];
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
    rtcInitIntersectContext(&v->embree);
    v->flat = flat;
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
    struct scene_visitor plain, *v = visitor != NULL ? visitor : &plain;
    plain.visit = NULL;
    rtcInitIntersectContext(&plain.embree);
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
            rtcOccluded1(s->block, &v->embree, &q);
            if (q.tfar < 0) return true;
        }
        if (leaves || !isfinite(t)) return false;
        advance(&r, t);
        span -= t;
    }
    return false;
}
