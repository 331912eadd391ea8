#include "geometry/diameter/scale_noise.h"

#include <math.h>
#include <string.h>

/* Number of scales measured (up to 2.3 voxels); coarser ones follow by their law, for little void is far enough from
 * material. */
enum { N_MEASURED = 10 };
static const float MATERIAL = 0.4f; /* density blurred by 1.4 voxels that counts as material */
static const double MATERIAL_SIGMA = 1.4;
/* A Gaussian and its Laplacian reach 2.5 standard deviations; material itself is blurred by some voxels. */
static const double REACH_SIGMA = 2.5, REACH_VOXEL = 1.5;
static const double MIN_VOID_VOXEL = 500.0;
/* Densities are clamped at 0, which halves the noise of void, but not that at the surfaces of fibers. Where half of the
 * void is clamped, the variance at fibers is 1.4 times as large (found on phantoms of 4 and 7 voxels). */
static const double CLAMPED_GAIN = 0.8;

/* Lowers the distance of voxel (i, j, k) to the least distance of its neighbours on one side plus one. */
static void pass_on(uint8_t *far, const size_t n[3], size_t i, size_t j, size_t k, int side)
{
    size_t at = (k * n[1] + j) * n[0] + i;
    uint8_t least = far[at];
    for (int m = 0; m < 13; m++) {
        ptrdiff_t d[3] = {m % 3 - 1, m / 3 % 3 - 1, m / 9 - 1}, x[3] = {(ptrdiff_t)i, (ptrdiff_t)j, (ptrdiff_t)k};
        bool inside = true;
        for (int a = 0; a < 3; a++) {
            x[a] += side * d[a];
            inside = inside && x[a] >= 0 && x[a] < (ptrdiff_t)n[a];
        }
        if (!inside) continue;
        uint8_t there = far[((size_t)x[2] * n[1] + (size_t)x[1]) * n[0] + (size_t)x[0]];
        if (there < UINT8_MAX && there + 1 < least) least = (uint8_t)(there + 1);
    }
    far[at] = least;
}

/* Replaces a map of 0 and UINT8_MAX by the distances from the zeros, as steps to one of the 26 neighbours. */
static void distances(uint8_t *far, const size_t n[3])
{
    for (size_t k = 0; k < n[2]; k++)
        for (size_t j = 0; j < n[1]; j++)
            for (size_t i = 0; i < n[0]; i++) pass_on(far, n, i, j, k, 1);
    for (size_t k = n[2]; k-- > 0;)
        for (size_t j = n[1]; j-- > 0;)
            for (size_t i = n[0]; i-- > 0;) pass_on(far, n, i, j, k, -1);
}

void scale_find_void(const float *density, float *a, float *b, uint8_t *far, const size_t n[3])
{
    size_t n_voxel = n[0] * n[1] * n[2];
    memcpy(a, density, n_voxel * sizeof *a);
    scale_blur(a, b, n, MATERIAL_SIGMA);
    for (size_t i = 0; i < n_voxel; i++) far[i] = a[i] > MATERIAL || !(fabsf(a[i]) > 1e-6f) ? 0 : UINT8_MAX;
    distances(far, n);
}

/* Adds the squared responses of the void voxels at one scale. */
static void add_scale(struct scale_noise *s, int i_scale, const float *a, const uint8_t *far, const size_t n[3])
{
    ptrdiff_t sy = (ptrdiff_t)n[0], sz = (ptrdiff_t)(n[0] * n[1]);
    double sigma = scale_sigma(i_scale), square = 0.0, count = 0.0;
    double least = REACH_SIGMA * sigma + REACH_VOXEL;
    for (size_t k = 2; k + 2 < n[2]; k++)
        for (size_t j = 2; j + 2 < n[1]; j++)
            for (size_t i = 2; i + 2 < n[0]; i++) {
                size_t at = (k * n[1] + j) * n[0] + i;
                if (!(far[at] > least)) continue;
                double r = sigma * sigma * (double)scale_minus_laplacian(a + at, sy, sz);
                square += r * r;
                count += 1.0;
            }
    s->square[i_scale] += square;
    s->n[i_scale] += count;
}

static void count_clamped(struct scale_noise *s, const float *density, const uint8_t *far, const size_t n[3])
{
    for (size_t i = 0; i < n[0] * n[1] * n[2]; i++) {
        bool is_void = far[i] > REACH_SIGMA * scale_sigma(0) + REACH_VOXEL;
        s->n_void += is_void;
        s->n_clamped += is_void && !(fabsf(density[i]) > 0.0f);
    }
}

void scale_noise_add(struct scale_noise *s, const float *density, float *a, float *b, uint8_t *far, const size_t n[3])
{
    scale_find_void(density, a, b, far, n);
    count_clamped(s, density, far, n);
    memcpy(a, density, n[0] * n[1] * n[2] * sizeof *a);
    for (int i = 0; i < N_MEASURED; i++) {
        scale_blur_on(a, b, n, i);
        add_scale(s, i, a, far, n);
    }
}

bool scale_noise_variance(const struct scale_noise *s, double var[N_SCALE])
{
    if (s->n[0] < MIN_VOID_VOXEL) return false;
    double gain = 1.0 + CLAMPED_GAIN * s->n_clamped / s->n_void;
    var[0] = gain * s->square[0] / s->n[0];
    for (int i = 1; i < N_SCALE; i++) {
        double ratio = scale_sigma(i - 1) / scale_sigma(i);
        var[i] = s->n[i] >= MIN_VOID_VOXEL ? gain * s->square[i] / s->n[i] : var[i - 1] * ratio * ratio * ratio;
    }
    return true;
}

double scale_noise_of_voxels(const float *a, const size_t n[3])
{
    static const float d2[3] = {1.0f, -2.0f, 1.0f};
    size_t count = 0;
    double sum = 0.0;
    for (size_t k = 1; k + 1 < n[2]; k++)
        for (size_t j = 1; j + 1 < n[1]; j++)
            for (size_t i = 1; i + 1 < n[0]; i++) {
                float response = 0.0f;
                for (size_t m = 0; m < 27; m++)
                    response += d2[m % 3] * d2[m / 3 % 3] * d2[m / 9] *
                                a[((k + m / 9 - 1) * n[1] + j + m / 3 % 3 - 1) * n[0] + i + m % 3 - 1];
                sum += (double)(response * response);
                count++;
            }
    return count > 0 ? sum / (216.0 * (double)count) : 0.0;
}

void scale_noise_white(double noise_var, float *a, float *b, double var[N_SCALE])
{
    enum { EDGE = SCALE_EDGE };
    const size_t n[3] = {EDGE, EDGE, EDGE};
    const ptrdiff_t sy = EDGE, sz = EDGE * EDGE;
    memset(a, 0, EDGE * EDGE * EDGE * sizeof *a);
    a[(EDGE / 2) * (sz + sy + 1)] = 1.0f;
    for (int i = 0; i < N_SCALE; i++) {
        double sigma = scale_sigma(i), sum = 0.0;
        scale_blur_on(a, b, n, i);
        for (ptrdiff_t at = sz + sy + 1; at < EDGE * sz - sz - sy - 1; at++) {
            double r = sigma * sigma * (double)scale_minus_laplacian(a + at, sy, sz);
            sum += r * r;
        }
        var[i] = noise_var * sum;
    }
}
