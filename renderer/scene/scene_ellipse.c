#include "renderer/scene/scene_ellipse.h"

#include "renderer/scene/scene_ends.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Cosine of half a bend below which a segment ends at a plane across itself: sharper miters would reach too far. */
#define LEAST_MITER 0.25f
/* Segments overlap by this part of a radius, so that rounding leaves no gap between neighbours. */
#define OVERLAP 1e-3f

static inline float dot(const float a[3], const float b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static inline void cross(const float a[3], const float b[3], float out[3])
{
    for (int i = 0; i < 3; i++) out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

static float normalise(float v[3])
{
    const float length = sqrtf(dot(v, v));
    for (int a = 0; a < 3; a++) v[a] /= length;
    return length;
}

/* A unit vector at right angles with u. */
static void any_across(const float u[3], float out[3])
{
    const float x[3] = {1, 0, 0}, y[3] = {0, 1, 0};
    cross(u, fabsf(u[0]) < 0.7f ? x : y, out);
    normalise(out);
}

/* Axis and section of a segment, without its ends. */
static void fill_cylinder(const struct scene *s, size_t i, struct scene_ellipse *e)
{
    const size_t first = s->segment_vertex[i];
    const struct scene_vertex *x = &s->vertex[first];
    const float radius = 0.5f * (x[0].radius + x[1].radius), p[3] = {x[0].x, x[0].y, x[0].z};
    float ratio = 0.5f * (s->ratio[first] + s->ratio[first + 1]);
    memcpy(e->p, p, sizeof e->p);
    memcpy(e->u, (const float[3]){x[1].x - x[0].x, x[1].y - x[0].y, x[1].z - x[0].z}, sizeof e->u);
    e->length = normalise(e->u);
    if (!scene_short_axis(s, i, e->u, e->v)) {
        ratio = 1;
        any_across(e->u, e->v);
    }
    cross(e->u, e->v, e->w);
    const float major = radius * sqrtf(ratio), minor = radius / sqrtf(ratio);
    for (int a = 0; a < 3; a++) {
        e->reach[a] = sqrtf(minor * minor * e->v[a] * e->v[a] + major * major * e->w[a] * e->w[a]);
        e->v[a] /= minor;
        e->w[a] /= major;
    }
    e->sharpest_mm = minor * minor / major;
}

/* The plane between a segment and its neighbour, whose direction is next; NULL: there is none. */
static void fill_end(const struct scene_ellipse *e, const float next[3], float normal[3], float *beyond)
{
    float n[3] = {0, 0, 0}, across = 0;
    for (int a = 0; a < 3 && next != NULL; a++) n[a] = e->u[a] + next[a];
    if (!(dot(n, n) > 4 * LEAST_MITER * LEAST_MITER)) memcpy(n, e->u, sizeof n);
    normalise(n);
    const float cosine = dot(n, e->u);
    for (int a = 0; a < 3; a++) across += e->reach[a] * e->reach[a];
    memcpy(normal, n, sizeof n);
    *beyond = sqrtf(across) * (sqrtf(fmaxf(1 - cosine * cosine, 0)) / cosine + OVERLAP);
}

/* The direction in which the fiber runs before or after a segment, in the sense of that segment. */
static bool direction_beside(const struct scene *s, size_t i, bool after, float u[3])
{
    if ((s->segment_flag[i] & (after ? RTC_CURVE_FLAG_NEIGHBOR_RIGHT : RTC_CURVE_FLAG_NEIGHBOR_LEFT)) != 0) {
        memcpy(u, s->ellipse[after ? i + 1 : i - 1].u, sizeof s->ellipse->u);
        return true;
    }
    const struct scene_link *l = scene_ends_find(s->ends, (uint32_t)i, after);
    if (l == NULL) return false;
    const float sign = after == l->other_after ? -1.0f : 1.0f;
    for (int a = 0; a < 3; a++) u[a] = sign * s->ellipse[l->i_other].u[a];
    return true;
}

status scene_ellipse_fill(struct scene *s, struct error *err)
{
    s->ellipse = malloc(s->n_segment * sizeof *s->ellipse);
    if (s->ellipse == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot build scene: no memory for %zu sections", s->n_segment);
    for (size_t i = 0; i < s->n_segment; i++) fill_cylinder(s, i, &s->ellipse[i]);
    for (size_t i = 0; i < s->n_segment; i++) {
        struct scene_ellipse *e = &s->ellipse[i];
        float before[3], after[3];
        e->joined[0] = direction_beside(s, i, false, before);
        e->joined[1] = direction_beside(s, i, true, after);
        fill_end(e, e->joined[0] ? before : NULL, e->begin, &e->beyond[0]);
        fill_end(e, e->joined[1] ? after : NULL, e->end, &e->beyond[1]);
    }
    return STATUS_OK;
}

static void bounds(const struct RTCBoundsFunctionArguments *a)
{
    const struct scene *s = a->geometryUserPtr;
    const struct scene_ellipse *e = &s->ellipse[a->primID];
    float low[3], high[3];
    for (int i = 0; i < 3; i++) {
        const float one = e->p[i] - e->beyond[0] * e->u[i], other = e->p[i] + (e->length + e->beyond[1]) * e->u[i];
        low[i] = fminf(one, other) - (1 + OVERLAP) * e->reach[i];
        high[i] = fmaxf(one, other) + (1 + OVERLAP) * e->reach[i];
    }
    *a->bounds_o = (struct RTCBounds){.lower_x = low[0],
                                      .lower_y = low[1],
                                      .lower_z = low[2],
                                      .upper_x = high[0],
                                      .upper_y = high[1],
                                      .upper_z = high[2]};
}

/* Cuts off what lies outside of a plane through p with an outward normal. False: nothing is left. */
static bool cut(struct scene_ellipse_span *span, const float normal[3], float sign, float outside, bool joint,
                const float d[3])
{
    const float rate = sign * dot(normal, d), t = -outside / rate;
    if (rate == 0) return outside <= 0;
    if (rate < 0 && t > span->begin) {
        span->begin = t;
        span->joint_begin = joint;
        for (int a = 0; a < 3; a++) span->normal_begin[a] = sign * normal[a];
    } else if (rate > 0 && t < span->end) {
        span->end = t;
        span->joint_end = joint;
        for (int a = 0; a < 3; a++) span->normal_end[a] = sign * normal[a];
    }
    return span->begin < span->end;
}

/* The discriminant is that of the distance from the axis, which keeps its digits for rays that start many radii
 * away. */
bool scene_ellipse_span(const struct scene_ellipse *e, const float from[3], const float d[3],
                        struct scene_ellipse_span *span)
{
    const float o[3] = {from[0] - e->p[0], from[1] - e->p[1], from[2] - e->p[2]};
    const float ov = dot(e->v, o), ow = dot(e->w, o), dv = dot(e->v, d), dw = dot(e->w, d);
    const float square = dv * dv + dw * dw, off = ov * dw - ow * dv, root2 = square - off * off;
    if (!(root2 > 0)) return false;
    const float root = sqrtf(root2), middle = -(ov * dv + ow * dw), slack = OVERLAP * e->sharpest_mm;
    span->begin = (middle - root) / square;
    span->end = (middle + root) / square;
    span->joint_begin = span->joint_end = false;
    float from_end[3];
    for (int a = 0; a < 3; a++) {
        const float v = e->v[a], w = e->w[a];
        span->normal_begin[a] = (ov + span->begin * dv) * v + (ow + span->begin * dw) * w;
        span->normal_end[a] = (ov + span->end * dv) * v + (ow + span->end * dw) * w;
        from_end[a] = o[a] - e->length * e->u[a];
    }
    return cut(span, e->begin, -1, -dot(e->begin, o) - slack, e->joined[0], d) &&
           cut(span, e->end, 1, dot(e->end, from_end) - slack, e->joined[1], d);
}

/* Tells Embree of the nearest face of a segment that a ray meets, where it comes in or where it comes out, unless the
 * filter refuses it. Planes between segments of one fiber are no faces for rays that have a filter (scene_faces.h). */
static bool meet(const struct scene_ellipse *e, struct RTCRay *ray, struct RTCHit *hit,
                 struct RTCFilterFunctionNArguments *filter)
{
    const float o[3] = {ray->org_x, ray->org_y, ray->org_z}, d[3] = {ray->dir_x, ray->dir_y, ray->dir_z};
    struct scene_ellipse_span span;
    if (!scene_ellipse_span(e, o, d, &span)) return false;
    for (int out = 0; out < 2; out++) {
        const float t = out ? span.end : span.begin, *n = out ? span.normal_end : span.normal_begin, far = ray->tfar;
        const bool joint = out ? span.joint_end : span.joint_begin;
        if (!(t > ray->tnear && t < far) || (joint && filter->context->filter != NULL)) continue;
        float along = 0;
        for (int a = 0; a < 3; a++) along += e->u[a] * (o[a] - e->p[a] + t * d[a]);
        hit->Ng_x = n[0];
        hit->Ng_y = n[1];
        hit->Ng_z = n[2];
        hit->u = fminf(fmaxf(along / e->length, 0), 1);
        ray->tfar = t;
        filter->valid[0] = -1;
        if (filter->context->filter != NULL) filter->context->filter(filter);
        if (filter->valid[0] != 0) return true;
        ray->tfar = far;
    }
    return false;
}

/* Rays come one by one: N is 1. */
static void intersect(const struct RTCIntersectFunctionNArguments *a)
{
    const struct scene *s = a->geometryUserPtr;
    struct RTCRayHit *q = (struct RTCRayHit *)(void *)a->rayhit;
    struct RTCHit hit = {.primID = a->primID, .geomID = a->geomID, .instID = {a->context->instID[0]}};
    int valid = -1;
    struct RTCFilterFunctionNArguments filter = {
        .valid = &valid, .context = a->context, .ray = (void *)&q->ray, .hit = (void *)&hit, .N = 1};
    if (a->valid[0] != 0 && meet(&s->ellipse[a->primID], &q->ray, &hit, &filter)) q->hit = hit;
}

static void occlude(const struct RTCOccludedFunctionNArguments *a)
{
    const struct scene *s = a->geometryUserPtr;
    struct RTCRay *ray = (struct RTCRay *)(void *)a->ray;
    struct RTCHit hit = {.primID = a->primID, .geomID = a->geomID, .instID = {a->context->instID[0]}};
    int valid = -1;
    struct RTCFilterFunctionNArguments filter = {
        .valid = &valid, .context = a->context, .ray = a->ray, .hit = (void *)&hit, .N = 1};
    if (a->valid[0] != 0 && meet(&s->ellipse[a->primID], ray, &hit, &filter)) ray->tfar = -INFINITY;
}

RTCGeometry scene_ellipse_geometry(struct scene *s)
{
    RTCGeometry g = rtcNewGeometry(s->device, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(g, (unsigned)s->n_segment);
    rtcSetGeometryUserData(g, s);
    rtcSetGeometryBoundsFunction(g, bounds, NULL);
    rtcSetGeometryIntersectFunction(g, intersect);
    rtcSetGeometryOccludedFunction(g, occlude);
    return g;
}
