#include "geometry/fibers/fiber_view.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

static size_t wrap(long i, size_t n) { return (size_t)((i % (long)n + (long)n) % (long)n); }

/* A section from above: half its width, half its height, and the slope of its flat side across the fiber. */
struct outline {
    double half_m, top_m, rise;
    bool is_flat;
};

/* Ratio of axes beyond which a section is drawn as it lies; others are drawn round, as most models see them. */
#define FLAT_RATIO 4.0f

/* The outline of the segment from vertex k of fiber i. */
static struct outline outline_of(const struct fiber_set *f, size_t i, size_t k)
{
    const double r = (double)f->radius_m[i];
    if (f->shape == NULL || f->shape[k].ratio <= FLAT_RATIO) return (struct outline){r, r, 0.0, false};
    const struct fiber_shape *s = &f->shape[k];
    const float *p = f->position_m + 3 * k, *axis = s->long_axis;
    const double d[2] = {(double)p[3] - (double)p[0], (double)p[4] - (double)p[1]}, length = hypot(d[0], d[1]);
    const double across = length > 0.0 ? ((double)axis[1] * d[0] - (double)axis[0] * d[1]) / length : 0.0;
    double wide_m = 0.0, thick_m = 0.0;
    for (size_t j = 0; j < 2; j++) {
        wide_m += 0.5 * (double)s[j].radius * sqrt((double)s[j].ratio);
        thick_m += 0.5 * (double)s[j].radius / sqrt((double)s[j].ratio);
    }
    const double flat_m = wide_m * fabs(across), half_m = fmax(flat_m, thick_m);
    return (struct outline){half_m, thick_m, flat_m > thick_m ? (double)axis[2] / across : 0.0, true};
}

/* Raises the heights of the pixels under the segment from a to b. Only round ones have caps at their ends. */
static void draw_segment(const float a[3], const float b[3], const struct outline *o, double pixel_size_m,
                         const size_t n[2], float *height)
{
    const double r = o->half_m;
    double d[2] = {(double)b[0] - a[0], (double)b[1] - a[1]}, d2 = fmax(d[0] * d[0] + d[1] * d[1], 1e-30);
    const double per_length = 1.0 / sqrt(d2), beyond = 0.5 * pixel_size_m * per_length, shape = o->top_m / r;
    long low[2], high[2];
    for (int x = 0; x < 2; x++) {
        low[x] = (long)floor((fmin((double)a[x], (double)b[x]) - r) / pixel_size_m - 0.5);
        high[x] = (long)ceil((fmax((double)a[x], (double)b[x]) + r) / pixel_size_m - 0.5);
    }
    for (long j = low[1]; j <= high[1]; j++) {
        float *row = height + wrap(j, n[1]) * n[0];
        size_t at = wrap(low[0], n[0]);
        for (long l = low[0]; l <= high[0]; l++, at = at + 1 < n[0] ? at + 1 : 0) {
            double q[2] = {((double)l + 0.5) * pixel_size_m - a[0], ((double)j + 0.5) * pixel_size_m - a[1]};
            double t = (q[0] * d[0] + q[1] * d[1]) / d2;
            if (o->is_flat && (t < -beyond || t > 1.0 + beyond)) continue;
            t = t < 0.0 ? 0.0 : t > 1.0 ? 1.0 : t;
            double off[2] = {q[0] - t * d[0], q[1] - t * d[1]}, off2 = off[0] * off[0] + off[1] * off[1];
            if (off2 > r * r) continue;
            const double side = (q[1] * d[0] - q[0] * d[1]) * per_length;
            float z = (float)((double)a[2] + t * ((double)b[2] - a[2]) + shape * sqrt(r * r - off2) + o->rise * side);
            if (z > row[at]) row[at] = z;
        }
    }
}

/* Computes the height of the topmost fiber surface over each pixel of the tile (periodic). Pixels without a fiber
 * keep their height. */
static void draw(const struct fiber_set *f, double pixel_size_m, const size_t n[2], float *height)
{
    for (size_t i = 0; i < f->n_fiber; i++)
        for (size_t k = f->first_vertex[i]; k + 1 < f->first_vertex[i + 1]; k++) {
            const struct outline o = outline_of(f, i, k);
            draw_segment(f->position_m + 3 * k, f->position_m + 3 * k + 3, &o, pixel_size_m, n, height);
        }
}

status fiber_top_view(const struct fiber_set *f, double pixel_size_m, size_t size[2], uint8_t **grey, double *cover,
                      struct error *err)
{
    if (!(pixel_size_m > 0.0)) return error_set(err, STATUS_INVALID, "the pixel size must be positive");
    for (int a = 0; a < 2; a++) size[a] = (size_t)fmax(1.0, round(f->tile_size_m[a] / pixel_size_m));
    size_t n = size[0] * size[1], n_covered = 0;
    float *height = malloc(n * sizeof *height);
    uint8_t *out = grey != NULL ? malloc(n) : NULL;
    if (height == NULL || (grey != NULL && out == NULL)) {
        free(height);
        free(out);
        return error_set(err, STATUS_NO_MEMORY, "cannot draw the top view: out of memory");
    }
    for (size_t i = 0; i < n; i++) height[i] = -INFINITY;
    draw(f, pixel_size_m, size, height);
    double low, high;
    fiber_set_z_range_m(f, &low, &high);
    for (size_t i = 0; i < n; i++) {
        bool covered = height[i] > -INFINITY;
        n_covered += covered;
        if (out != NULL)
            out[i] =
                covered ? (uint8_t)(40.0 + 215.0 * fmin(1.0, fmax(0.0, ((double)height[i] - low) / (high - low)))) : 0;
    }
    *cover = (double)n_covered / (double)n;
    if (grey != NULL) *grey = out;
    free(height);
    return STATUS_OK;
}
