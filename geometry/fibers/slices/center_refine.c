#include "geometry/fibers/slices/center_refine.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>

enum { N_ROUND = 6, LANES = 8 };
static const float WINDOW_RADII = 1.2f;
static const float FLOOR = 0.15f; /* densities up to this count as void, so that noise there has no effect */

struct box {
    ptrdiff_t u0, u1, v0, v1; /* u1, v1 are excluded */
};

/* A center with what its pixels share. */
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

/* Gives n pixels of a row to a center if it is the nearest so far. du0, dv: place of the first from the center. The
 * distance is perpendicular to the axis. Without branches, so that the loop is vectorised. */
static void claim_row(const struct window *w, float index, float du0, float dv, int n, float *restrict distance,
                      float *restrict owner)
{
    const float slope_u = w->slope_u, along_v = dv * w->slope_v, dv2 = dv * dv, stretch2 = w->stretch2;
    const float radius2 = w->radius2, edge2 = w->edge2;
    for (int u = 0; u < n; u++) {
        float du = du0 + (float)u, along = du * slope_u + along_v;
        float d2 = du * du + dv2 - along * along / stretch2, own = d2 - radius2, old = distance[u], other = owner[u];
        bool mine = d2 < edge2 && own < old;
        distance[u] = mine ? own : old;
        owner[u] = mine ? index : other;
    }
}

static void claim_pixels(const struct refine_slice *s, const struct window *window, size_t n)
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
            ptrdiff_t at = v * (ptrdiff_t)s->width + b->u0;
            claim_row(w, (float)i, (float)b->u0 + 0.5f - w->u, (float)v + 0.5f - w->v, (int)(b->u1 - b->u0),
                      s->distance + at, s->owner + at);
        }
    }
}

/* Sums over the pixels of a center: their weight, and the weight times the place from the center. */
struct centroid {
    float sum[LANES], du[LANES], dv[LANES];
};

/* Adds at most LANES pixels of a row from number `at` on. place: of the first from the center. Pixels beyond limit
 * along the row have no mirror image in the picture. */
static void add_pixels(const struct refine_slice *s, ptrdiff_t at, float index, const float place[2], int n,
                       float limit, struct centroid *c)
{
    const float *image = s->image + at, *owner = s->owner + at, *distance = s->distance + at;
    for (int u = 0; u < n; u++) {
        float du = place[0] + (float)u, w = image[u] - FLOOR;
        bool mine = distance[u] < INFINITY && owner[u] == index && w > 0.0f && fabsf(du) <= limit;
        w = mine ? w : 0.0f;
        c->sum[u] += w;
        c->du[u] += w * du;
        c->dv[u] += w * place[1];
    }
}

/* Moves a center to the centroid of its pixels. Pixels whose mirror image is cut off by the border do not count. */
static void move_to_centroid(const struct refine_slice *s, const struct window *w, float index, struct center *c)
{
    struct centroid sums = {{0.0f}, {0.0f}, {0.0f}};
    const struct box *b = &w->box;
    float limit_u = fminf(w->u, (float)s->width - w->u), limit_v = fminf(w->v, (float)s->height - w->v);
    for (ptrdiff_t v = b->v0; v < b->v1; v++) {
        float dv = (float)v + 0.5f - w->v;
        if (fabsf(dv) > limit_v) continue;
        for (ptrdiff_t u = b->u0; u < b->u1; u += LANES) {
            const float place[2] = {(float)u + 0.5f - w->u, dv};
            int n = b->u1 - u < LANES ? (int)(b->u1 - u) : LANES;
            add_pixels(s, v * (ptrdiff_t)s->width + u, index, place, n, limit_u, &sums);
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
        claim_pixels(slice, window, n);
        for (size_t i = 0; i < n; i++) move_to_centroid(slice, &window[i], (float)i, &center[i]);
    }
    free(window);
    return true;
}
