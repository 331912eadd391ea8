#include "geometry/phantom/slice_blur.h"

#include "geometry/volume/volume.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

long slice_blur_reach(double sd_voxel) { return (long)ceil(4.0 * sd_voxel); }

status slice_blur_init(struct slice_blur *b, double sd, const size_t n[3], size_t n_held, struct error *err)
{
    *b = (struct slice_blur){.reach = slice_blur_reach(sd), .n = {n[0], n[1], n[2]}, .n_held = n_held};
    b->kernel = calloc((size_t)(2 * b->reach + 1), sizeof *b->kernel);
    b->held = malloc(n_held * n[0] * n[1] * sizeof *b->held);
    if (b->kernel == NULL || b->held == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot scan phantom of %zu voxels: out of memory", volume_n_voxel(n));
    double sum = 0.0;
    for (long m = -b->reach; m <= b->reach; m++) sum += sd > 0.0 ? exp(-0.5 * (double)(m * m) / (sd * sd)) : 1.0;
    for (long m = -b->reach; m <= b->reach; m++)
        b->kernel[m + b->reach] = (float)((sd > 0.0 ? exp(-0.5 * (double)(m * m) / (sd * sd)) : 1.0) / sum);
    return STATUS_OK;
}

void slice_blur_release(struct slice_blur *b)
{
    free(b->kernel);
    free(b->held);
    *b = (struct slice_blur){0};
}

static size_t wrapped(long at, size_t n) { return (size_t)((at % (long)n + (long)n) % (long)n); }

void slice_blur_take(struct slice_blur *b, size_t k, const float *from, float *row)
{
    const size_t *n = b->n;
    float *to = b->held + volume_index(n, 0, 0, k % b->n_held);
    for (size_t j = 0; j < n[1]; j++) {
        memset(row + j * n[0], 0, n[0] * sizeof *row);
        for (long m = -b->reach; m <= b->reach; m++) {
            size_t shift = wrapped(m, n[0]); /* i + m, from 0 on again at the end of the row */
            float w = b->kernel[m + b->reach];
            const float *in = from + j * n[0];
            float *out = row + j * n[0];
            for (size_t i = 0; i < n[0] - shift; i++) out[i] += w * in[i + shift];
            for (size_t i = n[0] - shift; i < n[0]; i++) out[i] += w * in[i + shift - n[0]];
        }
    }
    for (size_t j = 0; j < n[1]; j++) {
        memset(to + j * n[0], 0, n[0] * sizeof *to);
        for (long m = -b->reach; m <= b->reach; m++) {
            const float *other = row + wrapped((long)j + m, n[1]) * n[0];
            for (size_t i = 0; i < n[0]; i++) to[j * n[0] + i] += b->kernel[m + b->reach] * other[i];
        }
    }
}

double slice_blur_at(const struct slice_blur *b, size_t i, size_t j, size_t k)
{
    double sum = 0.0;
    for (long m = -b->reach; m <= b->reach; m++) {
        long z = (long)k + m;
        if (z >= 0 && z < (long)b->n[2])
            sum += (double)b->kernel[m + b->reach] * (double)b->held[volume_index(b->n, i, j, (size_t)z % b->n_held)];
    }
    return sum;
}

/* Sum of the squares of the weights that fall on whole voxel periods together. */
static double periodic_power(const struct slice_blur *b, size_t n)
{
    double power = 0.0;
    for (size_t i = 0; i < n; i++) {
        double weight = 0.0;
        for (long m = -b->reach; m <= b->reach; m++)
            if (wrapped(m, n) == i) weight += (double)b->kernel[m + b->reach];
        power += weight * weight;
    }
    return power;
}

double slice_blur_noise_sd(const struct slice_blur *b, size_t k)
{
    double power = 0.0;
    for (long m = -b->reach; m <= b->reach; m++) {
        long z = (long)k + m;
        double weight = (double)b->kernel[m + b->reach];
        if (z >= 0 && z < (long)b->n[2]) power += weight * weight;
    }
    return sqrt(power * periodic_power(b, b->n[0]) * periodic_power(b, b->n[1]));
}
