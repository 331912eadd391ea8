#include "geometry/fibers/slices/center_refine.h"

#include "base/lanes.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>

enum { N_ROUND = 6 };
static const float WINDOW_RADII = 1.2f;
static const float FLOOR = 0.15f; /* densities up to this count as void, so that noise there has no effect */

struct box {
    ptrdiff_t u0, u1, v0, v1; /* u1, v1 are excluded */
};

/* A center and the values that all its pixels share. */
struct window {
    float u, v, slope_u, slope_v, stretch2; /* stretch2: squared length of the axis per slice */
    float radius2, edge2;
    struct box box;
};

/* Finds the pixels whose perpendicular distance can be within the window; an empty box if the center lies outside of
 * the slice. */
static struct window window_of(const struct center *c, const struct refine_slice *s)
{
    float r = WINDOW_RADII * c->radius, width = (float)s->width, height = (float)s->height;
    struct window w = {.u = c->u,
                       .v = c->v,
                       .slope_u = c->slope_u,
                       .slope_v = c->slope_v,
                       .stretch2 = 1.0f + c->slope_u * c->slope_u + c->slope_v * c->slope_v,
                       .radius2 = c->radius * c->radius,
                       .edge2 = r * r};
    float su = r * sqrtf(1.0f + c->slope_u * c->slope_u), sv = r * sqrtf(1.0f + c->slope_v * c->slope_v);
    float u0 = floorf(c->u - su), u1 = floorf(c->u + su), v0 = floorf(c->v - sv), v1 = floorf(c->v + sv);
    if (!(u1 >= 0.0f) || !(v1 >= 0.0f) || !(u0 < width) || !(v0 < height)) return w;
    w.box = (struct box){u0 > 0.0f ? (ptrdiff_t)u0 : 0, (ptrdiff_t)(u1 < width - 1.0f ? u1 : width - 1.0f) + 1,
                         v0 > 0.0f ? (ptrdiff_t)v0 : 0, (ptrdiff_t)(v1 < height - 1.0f ? v1 : height - 1.0f) + 1};
    return w;
}

static void clear_row(float *distance, ptrdiff_t n)
{
    for (ptrdiff_t u = 0; u < n; u++) distance[u] = INFINITY;
}

static const lanes STEP = {0.0f, 1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f, 7.0f};

/* Gives the first n of LANES pixels of a row to a center if it is the nearest so far. du, dv: their places from the
 * center. The distance is perpendicular to the axis. */
static inline void assign_lanes(const struct window *w, float index, lanes du, float dv, ptrdiff_t n, float *distance,
                                float *owner)
{
    const lanes along = du * w->slope_u + dv * w->slope_v;
    const lanes d2 = du * du + dv * dv - along * along / w->stretch2, own = d2 - w->radius2;
    const lanes old = *(const lanes *)distance, other = *(const lanes *)owner, zero = {0.0f};
    const lane_mask mine = (STEP < (float)n) & (d2 < w->edge2) & (own < old);
    *(lanes *)distance = lanes_choose(mine, own, old);
    *(lanes *)owner = lanes_choose(mine, zero + index, other);
}

static void assign_pixels(const struct refine_slice *s, const struct window *window, size_t n)
{
    /* clear only the pixels that centers can reach, because no others are read later */
    for (size_t i = 0; i < n; i++) {
        const struct box *b = &window[i].box;
        for (ptrdiff_t v = b->v0; v < b->v1; v++)
            clear_row(s->distance + v * (ptrdiff_t)s->width + b->u0, b->u1 - b->u0);
    }
    for (size_t i = 0; i < n; i++) {
        const struct window *w = &window[i];
        const struct box *b = &w->box;
        for (ptrdiff_t v = b->v0; v < b->v1; v++) {
            for (ptrdiff_t u = b->u0; u < b->u1; u += LANES) {
                const ptrdiff_t at = v * (ptrdiff_t)s->width + u;
                const lanes du = (float)b->u0 + 0.5f - w->u + (STEP + (float)(u - b->u0));
                assign_lanes(w, (float)i, du, (float)v + 0.5f - w->v, b->u1 - u, s->distance + at, s->owner + at);
            }
        }
    }
}

/* Sums over the pixels of a center: their weight, and the weight times the place from the center. */
struct centroid {
    lanes sum, du, dv;
};

/* Adds the first n of LANES pixels of a row from number `at` on. place: of the first from the center. Pixels beyond
 * limit along the row have no mirror image in the picture. */
static inline void add_pixels(const struct refine_slice *s, ptrdiff_t at, float index, const float place[2],
                              ptrdiff_t n, float limit, struct centroid *c)
{
    const lanes owner = *(const lanes *)(s->owner + at), distance = *(const lanes *)(s->distance + at), zero = {0.0f};
    const lanes du = place[0] + STEP;
    lanes w = *(const lanes *)(s->image + at) - FLOOR;
    const lane_mask mine =
        (STEP < (float)n) & (distance < INFINITY) & (owner == index) & (w > zero) & (du <= limit) & (du >= -limit);
    w = lanes_choose(mine, w, zero);
    c->sum += w;
    c->du += w * du;
    c->dv += w * place[1];
}

/* Moves a center to the centroid of its pixels. Pixels whose mirror image is cut off by the border do not count. */
static void move_to_centroid(const struct refine_slice *s, const struct window *w, float index, struct center *c)
{
    struct centroid sums = {0};
    const struct box *b = &w->box;
    float limit_u = fminf(w->u, (float)s->width - w->u), limit_v = fminf(w->v, (float)s->height - w->v);
    for (ptrdiff_t v = b->v0; v < b->v1; v++) {
        float dv = (float)v + 0.5f - w->v;
        if (fabsf(dv) > limit_v) continue;
        for (ptrdiff_t u = b->u0; u < b->u1; u += LANES) {
            const float place[2] = {(float)u + 0.5f - w->u, dv};
            add_pixels(s, v * (ptrdiff_t)s->width + u, index, place, b->u1 - u, limit_u, &sums);
        }
    }
    float sum = 0.0f, du = 0.0f, dv = 0.0f;
    for (int l = 0; l < LANES; l++) {
        sum += sums.sum[l];
        du += sums.du[l];
        dv += sums.dv[l];
    }
    if (!(sum > 0.0f)) return;
    c->u += fminf(1.0f, fmaxf(-1.0f, du / sum));
    c->v += fminf(1.0f, fmaxf(-1.0f, dv / sum));
}

bool centers_refine(const struct refine_slice *slice, struct center *center, size_t n)
{
    struct window *window = malloc((n + 1) * sizeof *window);
    if (window == NULL) return false;
    for (int round = 0; round < N_ROUND; round++) {
        for (size_t i = 0; i < n; i++) window[i] = window_of(&center[i], slice);
        assign_pixels(slice, window, n);
        for (size_t i = 0; i < n; i++) move_to_centroid(slice, &window[i], (float)i, &center[i]);
    }
    free(window);
    return true;
}
