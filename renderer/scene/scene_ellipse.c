#include "renderer/scene/scene_ellipse.h"

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

/* The plane between a segment and its neighbour along u, which may be NULL. */
static void fill_end(const struct scene_ellipse *e, const struct scene_ellipse *next, float normal[3], float *beyond)
{
    float n[3] = {0, 0, 0}, across = 0;
    for (int a = 0; a < 3 && next != NULL; a++) n[a] = e->u[a] + next->u[a];
    if (!(dot(n, n) > 4 * LEAST_MITER * LEAST_MITER)) memcpy(n, e->u, sizeof n);
    normalise(n);
    const float cosine = dot(n, e->u);
    for (int a = 0; a < 3; a++) across += e->reach[a] * e->reach[a];
    memcpy(normal, n, sizeof n);
    *beyond = sqrtf(across) * (sqrtf(fmaxf(1 - cosine * cosine, 0)) / cosine + OVERLAP);
}

status scene_ellipse_fill(struct scene *s, struct error *err)
{
    s->ellipse = malloc(s->n_segment * sizeof *s->ellipse);
    if (s->ellipse == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot build scene: no memory for %zu sections", s->n_segment);
    for (size_t i = 0; i < s->n_segment; i++) fill_cylinder(s, i, &s->ellipse[i]);
    for (size_t i = 0; i < s->n_segment; i++) {
        struct scene_ellipse *e = &s->ellipse[i];
        const bool left = i > 0 && (s->segment_flag[i] & RTC_CURVE_FLAG_NEIGHBOR_LEFT) != 0,
                   right = i + 1 < s->n_segment && (s->segment_flag[i] & RTC_CURVE_FLAG_NEIGHBOR_RIGHT) != 0;
        fill_end(e, left ? e - 1 : NULL, e->begin, &e->beyond[0]);
        fill_end(e, right ? e + 1 : NULL, e->end, &e->beyond[1]);
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

/* Where a ray comes into a segment. The discriminant is that of the distance from the axis, which keeps its digits for
 * rays that start many radii away. */
static bool enter(const struct scene_ellipse *e, const struct RTCRay *ray, float *distance, float *along,
                  float normal[3])
{
    const float o[3] = {ray->org_x - e->p[0], ray->org_y - e->p[1], ray->org_z - e->p[2]},
                d[3] = {ray->dir_x, ray->dir_y, ray->dir_z};
    const float ov = dot(e->v, o), ow = dot(e->w, o), dv = dot(e->v, d), dw = dot(e->w, d);
    const float square = dv * dv + dw * dw, off = ov * dw - ow * dv, root2 = square - off * off;
    if (!(root2 > 0)) return false;
    const float t = -(ov * dv + ow * dw + sqrtf(root2)) / square, slack = OVERLAP * e->sharpest_mm;
    if (!(t > ray->tnear && t < ray->tfar)) return false;
    float x[3], from_end[3];
    for (int a = 0; a < 3; a++) {
        x[a] = o[a] + t * d[a];
        from_end[a] = x[a] - e->length * e->u[a];
    }
    if (dot(e->begin, x) < -slack || dot(e->end, from_end) > slack) return false;
    const float nv = ov + t * dv, nw = ow + t * dw;
    for (int a = 0; a < 3; a++) normal[a] = nv * e->v[a] + nw * e->w[a];
    *distance = t;
    *along = fminf(fmaxf(dot(e->u, x) / e->length, 0), 1);
    return true;
}

/* Rays come one by one: N is 1. */
static void intersect(const struct RTCIntersectFunctionNArguments *a)
{
    const struct scene *s = a->geometryUserPtr;
    struct RTCRayHit *q = (struct RTCRayHit *)(void *)a->rayhit;
    float t, along, normal[3];
    if (a->valid[0] == 0 || !enter(&s->ellipse[a->primID], &q->ray, &t, &along, normal)) return;
    q->ray.tfar = t;
    q->hit = (struct RTCHit){.Ng_x = normal[0],
                             .Ng_y = normal[1],
                             .Ng_z = normal[2],
                             .u = along,
                             .primID = a->primID,
                             .geomID = a->geomID,
                             .instID = {a->context->instID[0]}};
}

static void occlude(const struct RTCOccludedFunctionNArguments *a)
{
    const struct scene *s = a->geometryUserPtr;
    struct RTCRay *ray = (struct RTCRay *)(void *)a->ray;
    float t, along, normal[3];
    int valid = -1;
    if (a->valid[0] == 0 || !enter(&s->ellipse[a->primID], ray, &t, &along, normal)) return;
    struct RTCHit hit = {.Ng_x = normal[0], .Ng_y = normal[1], .Ng_z = normal[2], .u = along, .primID = a->primID};
    const struct RTCFilterFunctionNArguments filter = {.valid = &valid,
                                                       .geometryUserPtr = a->geometryUserPtr,
                                                       .context = a->context,
                                                       .ray = a->ray,
                                                       .hit = (struct RTCHitN *)(void *)&hit,
                                                       .N = 1};
    scene_occlusion_filter(&filter);
    if (valid != 0) ray->tfar = -INFINITY;
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
