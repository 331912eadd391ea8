/* Tiles of a periodic square map that a Gaussian footprint reaches, row by row, counted on over the periods: tile k of
 * a row of n is tile k mod n. */
#ifndef SELVEDGE_RENDERER_GLINT_WINDOW_H
#define SELVEDGE_RENDERER_GLINT_WINDOW_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

struct glint_window {
    float center_um[2], covariance_um2[3]; /* uu, uv, vv; uu and vv above 0 */
    float reach;                           /* standard deviations beyond which the footprint counts as 0 */
    float tile_um;
};

/* First and last row. */
static inline void glint_window_rows(const struct glint_window *w, int64_t range[2])
{
    const float high = w->reach * sqrtf(w->covariance_um2[2]);
    range[0] = (int64_t)floorf((w->center_um[1] - high) / w->tile_um);
    range[1] = (int64_t)floorf((w->center_um[1] + high) / w->tile_um);
}

/* First and last tile of a row that may touch the ellipse. Returns false when there is none. */
static inline bool glint_window_row(const struct glint_window *w, int64_t row, int64_t range[2])
{
    const float *c = w->covariance_um2, lean = c[1] / c[2];
    const float y[2] = {(float)row * w->tile_um - w->center_um[1], (float)(row + 1) * w->tile_um - w->center_um[1]};
    const float nearest = y[0] > 0 ? y[0] : y[1] < 0 ? y[1] : 0;
    const float left = 1 - nearest * nearest / (w->reach * w->reach * c[2]);
    if (left <= 0) return false;
    const float half = w->reach * sqrtf(fmaxf(c[0] - lean * c[1], 0) * left);
    range[0] = (int64_t)floorf((w->center_um[0] + fminf(lean * y[0], lean * y[1]) - half) / w->tile_um);
    range[1] = (int64_t)floorf((w->center_um[0] + fmaxf(lean * y[0], lean * y[1]) + half) / w->tile_um);
    return true;
}

/* a / b rounded down, b > 0. */
static inline int64_t glint_floor_div(int64_t a, int64_t b) { return a >= 0 ? a / b : -((b - 1 - a) / b); }

#endif
