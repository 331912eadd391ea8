#include "geometry/fibers/slices/slice_peaks.h"

#include "base/lanes.h"

#include <math.h>

/* Whether a pixel, perhaps at the border of a picture, is a peak among its neighbours; of equal pixels the first is. */
static bool is_border_peak(const struct peak_search *s, size_t u, size_t v)
{
    const float c = s->response[v * s->width + u];
    for (size_t y = v > 0 ? v - 1 : 0; y <= v + 1 && y < s->height; y++)
        for (size_t x = u > 0 ? u - 1 : 0; x <= u + 1 && x < s->width; x++) {
            const float r = s->response[y * s->width + x];
            if (r > c || (r == c && (y < v || (y == v && x < u)))) return false;
        }
    return true;
}

/* The strong peaks among LANES inner pixels of a row from p on, as bits. Of equal pixels the first is a peak. */
static inline unsigned inner_peaks(const float *p, size_t width, float least)
{
    const lanes c = *(const lanes *)p;
    const lane_mask higher = (c >= least) & (c > *(const lanes *)(p - 1)) & (c >= *(const lanes *)(p + 1));
    if (lanes_bits(higher) == 0) return 0;
    const float *before = p - width, *after = p + width;
    return lanes_bits(higher & (c > *(const lanes *)(before - 1)) & (c > *(const lanes *)before) &
                      (c > *(const lanes *)(before + 1)) & (c >= *(const lanes *)(after - 1)) &
                      (c >= *(const lanes *)after) & (c >= *(const lanes *)(after + 1)));
}

/* The same for the block of pixels from u on, which may lie at the border of the picture. */
static unsigned block_peaks(const struct peak_search *s, size_t u, size_t v)
{
    const float *row = s->response + v * s->width;
    if (v > 0 && v + 1 < s->height && u > 0 && u + LANES < s->width) return inner_peaks(row + u, s->width, s->least);
    unsigned peaks = 0;
    for (size_t l = 0; l < LANES && u + l < s->width; l++)
        if (row[u + l] >= s->least && is_border_peak(s, u + l, v)) peaks |= 1u << l;
    return peaks;
}

bool peaks_visit(const struct peak_search *s, peak_visitor visit, void *context)
{
    const size_t n_byte = (s->width + LANES - 1) / LANES;
    for (size_t v = 0; v < s->height; v++) {
        const uint8_t *candidate = s->candidate + v * n_byte;
        for (size_t b = 0; b < n_byte; b++) {
            if (candidate[b] == 0) continue;
            unsigned peaks = block_peaks(s, b * LANES, v) & candidate[b];
            for (; peaks != 0; peaks &= peaks - 1)
                if (!visit(context, b * LANES + (size_t)__builtin_ctz(peaks), v)) return false;
        }
    }
    return true;
}

void peak_offset(const struct peak_search *s, size_t u, size_t v, float offset[2])
{
    offset[0] = offset[1] = 0.0f;
    if (u == 0 || v == 0 || u + 1 >= s->width || v + 1 >= s->height) return;
    const float *p = s->response + v * s->width + u;
    size_t pitch = s->width;
    float gu = 0.0f, gv = 0.0f, uu = 0.0f, vv = 0.0f;
    for (ptrdiff_t r = -1; r <= 1; r++) {
        const float *q = p + r * (ptrdiff_t)pitch;
        gu += (q[1] - q[-1]) / 6.0f;
        uu += (q[1] - 2.0f * q[0] + q[-1]) / 3.0f;
        gv += (p[pitch + (size_t)(r + 1) - 1] - p[-(ptrdiff_t)pitch + r]) / 6.0f;
        vv += (p[(ptrdiff_t)pitch + r] - 2.0f * p[r] + p[-(ptrdiff_t)pitch + r]) / 3.0f;
    }
    float uv = (p[pitch + 1] - p[pitch - 1] - p[-(ptrdiff_t)pitch + 1] + p[-(ptrdiff_t)pitch - 1]) / 4.0f;
    float det = uu * vv - uv * uv;
    if (!(det > 0.0f) || !(uu < 0.0f)) return;
    offset[0] = fminf(1.0f, fmaxf(-1.0f, (uv * gv - vv * gu) / det));
    offset[1] = fminf(1.0f, fmaxf(-1.0f, (uv * gu - uu * gv) / det));
}
