#include "geometry/fibers/slices/center_refine.h"

#include <math.h>
#include <stdbool.h>

enum { N_ROUND = 6 };
static const float WINDOW_RADII = 1.2f;
static const float FLOOR = 0.15f; /* densities up to this count as void, so that noise there has no effect */

struct box {
    size_t u0, u1, v0, v1; /* inclusive */
};

/* Finds the pixels whose perpendicular distance can be within r. Returns false if the center lies outside of the
 * slice. */
static bool pixel_box(const struct center *c, float r, size_t width, size_t height, struct box *b)
{
    float su = r * sqrtf(1.0f + c->slope_u * c->slope_u), sv = r * sqrtf(1.0f + c->slope_v * c->slope_v);
    float u0 = floorf(c->u - su), u1 = floorf(c->u + su), v0 = floorf(c->v - sv), v1 = floorf(c->v + sv);
    if (!(u1 >= 0.0f) || !(v1 >= 0.0f) || !(u0 < (float)width) || !(v0 < (float)height)) return false;
    b->u0 = u0 > 0.0f ? (size_t)u0 : 0;
    b->v0 = v0 > 0.0f ? (size_t)v0 : 0;
    b->u1 = u1 < (float)(width - 1) ? (size_t)u1 : width - 1;
    b->v1 = v1 < (float)(height - 1) ? (size_t)v1 : height - 1;
    return true;
}

/* Squared distance of pixel (u, v) from the axis of c. */
static float perpendicular2(const struct center *c, size_t u, size_t v)
{
    float du = (float)u + 0.5f - c->u, dv = (float)v + 0.5f - c->v;
    float along = du * c->slope_u + dv * c->slope_v;
    return du * du + dv * dv - along * along / (1.0f + c->slope_u * c->slope_u + c->slope_v * c->slope_v);
}

static float window(const struct center *c) { return WINDOW_RADII * c->radius; }

static void claim_pixels(const struct refine_slice *s, const struct center *center, size_t n)
{
    struct box b;
    /* clear only the pixels that centers can reach, because no others are read later */
    for (size_t i = 0; i < n; i++) {
        if (!pixel_box(&center[i], window(&center[i]), s->width, s->height, &b)) continue;
        for (size_t v = b.v0; v <= b.v1; v++)
            for (size_t u = b.u0; u <= b.u1; u++) s->distance[v * s->width + u] = INFINITY;
    }
    for (size_t i = 0; i < n; i++) {
        const struct center *c = &center[i];
        float radius2 = c->radius * c->radius, edge2 = window(c) * window(c);
        if (!pixel_box(c, window(c), s->width, s->height, &b)) continue;
        for (size_t v = b.v0; v <= b.v1; v++)
            for (size_t u = b.u0; u <= b.u1; u++) {
                float d2 = perpendicular2(c, u, v);
                if (d2 >= edge2 || d2 - radius2 >= s->distance[v * s->width + u]) continue;
                s->distance[v * s->width + u] = d2 - radius2;
                s->owner[v * s->width + u] = (float)i;
            }
    }
}

static void move_to_centroid(const struct refine_slice *s, struct center *c, float index)
{
    struct box b;
    float sum = 0.0f, su = 0.0f, sv = 0.0f;
    if (!pixel_box(c, window(c), s->width, s->height, &b)) return;
    for (size_t v = b.v0; v <= b.v1; v++)
        for (size_t u = b.u0; u <= b.u1; u++) {
            size_t at = v * s->width + u;
            if (!(s->distance[at] < INFINITY) || s->owner[at] != index) continue;
            float w = s->image[at] - FLOOR;
            float mirror_u = 2.0f * c->u - (float)u - 0.5f, mirror_v = 2.0f * c->v - (float)v - 0.5f;
            if (mirror_u < 0.0f || mirror_v < 0.0f || mirror_u > (float)s->width || mirror_v > (float)s->height)
                continue; /* its mirror image is cut off by the border */
            if (w <= 0.0f) continue;
            sum += w;
            su += w * ((float)u + 0.5f - c->u);
            sv += w * ((float)v + 0.5f - c->v);
        }
    if (!(sum > 0.0f)) return;
    c->u += fminf(1.0f, fmaxf(-1.0f, su / sum));
    c->v += fminf(1.0f, fmaxf(-1.0f, sv / sum));
}

void centers_refine(const struct refine_slice *slice, struct center *center, size_t n)
{
    for (int round = 0; round < N_ROUND; round++) {
        claim_pixels(slice, center, n);
        for (size_t i = 0; i < n; i++) move_to_centroid(slice, &center[i], (float)i);
    }
}
