#include "geometry/fibers/fiber_view.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

/* Computes the height of the topmost fiber surface over each pixel of the tile (periodic). Pixels without a fiber
 * keep their height. */
static void draw(const struct fiber_set *f, double pixel_size_m, const size_t n[2], float *height)
{
    for (size_t i = 0; i < f->n_fiber; i++) {
        double r = f->radius_m[i];
        for (size_t k = f->first_vertex[i]; k + 1 < f->first_vertex[i + 1]; k++) {
            const float *a = f->position_m + 3 * k, *b = a + 3;
            double d[2] = {(double)b[0] - a[0], (double)b[1] - a[1]}, d2 = fmax(d[0] * d[0] + d[1] * d[1], 1e-30);
            long low[2], high[2];
            for (int x = 0; x < 2; x++) {
                low[x] = (long)floor((fmin((double)a[x], (double)b[x]) - r) / pixel_size_m - 0.5);
                high[x] = (long)ceil((fmax((double)a[x], (double)b[x]) + r) / pixel_size_m - 0.5);
            }
            for (long j = low[1]; j <= high[1]; j++)
                for (long l = low[0]; l <= high[0]; l++) {
                    double q[2] = {((double)l + 0.5) * pixel_size_m - a[0], ((double)j + 0.5) * pixel_size_m - a[1]};
                    double t = fmax(0.0, fmin(1.0, (q[0] * d[0] + q[1] * d[1]) / d2));
                    double off2 = pow(q[0] - t * d[0], 2.0) + pow(q[1] - t * d[1], 2.0);
                    if (off2 > r * r) continue;
                    long m[2] = {(long)n[0], (long)n[1]};
                    float z = (float)((double)a[2] + t * ((double)b[2] - a[2]) + sqrt(r * r - off2));
                    float *to = height + ((j % m[1] + m[1]) % m[1]) * m[0] + (l % m[0] + m[0]) % m[0];
                    *to = fmaxf(*to, z);
                }
        }
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
