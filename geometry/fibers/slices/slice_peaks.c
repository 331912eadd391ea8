#include "geometry/fibers/slices/slice_peaks.h"

#include <math.h>
#include <string.h>

/* Whether a pixel at the border of a picture is a peak among its neighbours there; of equal pixels the first is. */
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

/* The same for n inner pixels of a row: marks the strong peaks. Without branches, so that the loop is vectorised. */
static void mark_peaks(const float *p, size_t width, size_t n, float least, uint8_t *restrict mark)
{
    const float *before = p - width, *after = p + width;
    for (size_t u = 0; u < n; u++) {
        float c = p[u];
        mark[u] = (c >= least) & (c > p[u - 1]) & (c >= p[u + 1]) & (c > before[u - 1]) & (c > before[u]) &
                  (c > before[u + 1]) & (c >= after[u - 1]) & (c >= after[u]) & (c >= after[u + 1]);
    }
}

/* Marks the strong peaks among pixels from .. end - 1 of row v. */
static void mark_part(const struct peak_search *s, size_t v, size_t from, size_t end, uint8_t *mark)
{
    const float *row = s->response + v * s->width;
    const bool inner = v > 0 && v + 1 < s->height;
    const size_t first = from > 0 ? from : 1, last = end < s->width ? end : s->width - 1;
    if (inner && first < last) mark_peaks(row + first, s->width, last - first, s->least, mark + first);
    for (size_t u = from; u < end; u++)
        if (!inner || u == 0 || u + 1 == s->width) mark[u] = row[u] >= s->least && is_border_peak(s, u, v);
}

static bool is_candidate(const uint8_t *candidate, size_t u) { return (candidate[u / 8] >> u % 8 & 1u) != 0; }

/* Visits the peaks of row v in one run of blocks with candidates, pixels from .. end - 1. */
static bool visit_part(const struct peak_search *s, size_t v, size_t from, size_t end, uint8_t *mark,
                       peak_visitor visit, void *context)
{
    const uint8_t *candidate = s->candidate + v * ((s->width + 7) / 8);
    mark_part(s, v, from, end, mark);
    for (const uint8_t *m = mark + from; (m = memchr(m, 1, (size_t)(mark + end - m))) != NULL; m++) {
        const size_t u = (size_t)(m - mark);
        if (is_candidate(candidate, u) && !visit(context, u, v)) return false;
    }
    return true;
}

bool peaks_visit(const struct peak_search *s, uint8_t *mark, peak_visitor visit, void *context)
{
    const size_t n_byte = (s->width + 7) / 8;
    for (size_t v = 0; v < s->height; v++) {
        const uint8_t *candidate = s->candidate + v * n_byte;
        for (size_t b = 0; b < n_byte; b++) {
            const size_t from = b;
            while (b < n_byte && candidate[b] != 0) b++;
            const size_t end = b * 8 < s->width ? b * 8 : s->width;
            if (from * 8 < end && b > from && !visit_part(s, v, from * 8, end, mark, visit, context)) return false;
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
