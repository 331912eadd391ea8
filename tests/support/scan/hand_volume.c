#include "tests/support/scan/hand_volume.h"

#include <math.h>
#include <stdlib.h>

static void start(struct direction_volume *v, const size_t n[3], double voxel_m)
{
    const double size_m[3] = {voxel_m, voxel_m, voxel_m};
    if (direction_volume_init(v, n, size_m, NULL) != STATUS_OK) abort();
}

void hand_volume_uniform(struct direction_volume *v, const size_t n[3], double voxel_m, uint8_t density,
                         const float direction[3])
{
    start(v, n, voxel_m);
    for (size_t i = 0; i < volume_n_voxel(n); i++) {
        v->density[i] = density;
        direction_volume_set(v, i, direction);
    }
}

/* Height of a yarn's axis above its mean plane. */
static double wave(double along, double size, int yarn) { return 0.25 * sin(2 * M_PI * along / size + M_PI * yarn); }

void hand_volume_weave(struct direction_volume *v, const size_t n[3], double voxel_m, double occupancy)
{
    start(v, n, voxel_m);
    enum { N_YARN = 4 };
    double half_width = 0.5 * sqrt(occupancy * 1.35), half_height = 0.5 * sqrt(occupancy * 1.35) * 0.5;
    for (size_t k = 0; k < n[2]; k++)
        for (size_t j = 0; j < n[1]; j++)
            for (size_t i = 0; i < n[0]; i++) {
                size_t at = volume_index(n, i, j, k);
                double z = ((double)k + 0.5) / (double)n[2] - 0.5;
                for (int warp = 0; warp < 2; warp++) {
                    double along = (double)(warp ? j : i), size = (double)n[warp];
                    double x = ((double)(warp ? i : j) + 0.5) / (double)n[1 - warp] * N_YARN;
                    int yarn = (int)x;
                    double across = x - yarn - 0.5, up = z + 0.22 * (warp ? 1 : -1) - 0.5 * wave(along, size, yarn);
                    double r2 = across * across / (half_width * half_width) + up * up / (half_height * half_height);
                    if (r2 >= 1) continue;
                    double slope = 0.5 * (double)n[2] * (wave(along + 1, size, yarn) - wave(along, size, yarn));
                    float d[3] = {0, 0, (float)slope};
                    d[warp] = 1;
                    v->density[at] = (uint8_t)(90 + 165 * sqrt(1 - r2));
                    direction_volume_set(v, at, d);
                }
            }
}

void hand_volume_rasterise(struct direction_volume *v, const size_t n[3], double voxel_m, const struct fiber_set *f,
                           double scale)
{
    start(v, n, voxel_m);
    double *filled = calloc(volume_n_voxel(n), sizeof *filled);
    if (filled == NULL) abort();
    for (size_t i = 0; i < f->n_fiber; i++)
        for (size_t s = f->first_vertex[i]; s + 1 < f->first_vertex[i + 1]; s++) {
            const float *a = f->position_m + 3 * s, *b = a + 3;
            double d[3] = {(double)(b[0] - a[0]), (double)(b[1] - a[1]), (double)(b[2] - a[2])};
            double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]), r = (double)f->radius_m[i];
            size_t n_point = (size_t)(20 * length / voxel_m) + 1;
            for (size_t p = 0; p < n_point; p++) {
                size_t at[3];
                for (int x = 0; x < 3; x++) {
                    double cell = floor(((double)a[x] + d[x] * ((double)p + 0.5) / (double)n_point) / voxel_m);
                    double wrapped = cell - floor(cell / (double)n[x]) * (double)n[x];
                    at[x] = (size_t)wrapped;
                }
                size_t k = volume_index(n, at[0], at[1], at[2]);
                float direction[3] = {(float)(d[0] / length), (float)(d[1] / length), (float)(d[2] / length)};
                filled[k] += M_PI * r * r * length / (double)n_point / (voxel_m * voxel_m * voxel_m);
                direction_volume_set(v, k, direction);
            }
        }
    for (size_t k = 0; k < volume_n_voxel(n); k++) {
        double byte = rint(255 * scale * filled[k]);
        if (byte > 255) abort();
        v->density[k] = (uint8_t)byte;
    }
    free(filled);
}
