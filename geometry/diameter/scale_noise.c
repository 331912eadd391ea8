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
enum { FARTHEST = 8 }; /* voxels; the coarsest measured scale needs void beyond 7.2 */
static const double MIN_VOID_VOXEL = 500.0;
/* Densities are clamped at 0, which halves the noise of void, but not that at the surfaces of fibers. Where half of the
 * void is clamped, the variance at fibers is 1.4 times as large (found on phantoms of 4 and 7 voxels). */
static const double CLAMPED_GAIN = 0.8;

/* Replaces a map of 0 and UINT8_MAX by the distances from the zeros of the same row; UINT8_MAX from FARTHEST on. */
static void distances_in_rows(uint8_t *far, size_t n, size_t n_row)
{
    for (size_t k = 0; k < n_row; k++, far += n)
        for (int side = 0; side < 2; side++) {
            int steps = FARTHEST;
            for (size_t i = 0; i < n; i++) {
                uint8_t *at = far + (side == 0 ? i : n - 1 - i);
                steps = *at == 0 ? 0 : steps + 1;
                if (steps < FARTHEST && steps < *at) *at = (uint8_t)steps;
            }
        }
}

/* Takes the distances across n_line lines of n_inner neighbouring values into account, n_outer such blocks: each value
 * becomes the least of the larger of value and distance among the lines around it. */
static void distances_across(const uint8_t *in, uint8_t *out, size_t n_inner, size_t n_line, size_t n_outer)
{
    const ptrdiff_t last = (ptrdiff_t)n_line - 1;
    for (size_t o = 0; o < n_outer; o++, in += n_inner * n_line)
        for (ptrdiff_t c = 0; c <= last; c++, out += n_inner) {
            memset(out, UINT8_MAX, n_inner);
            for (ptrdiff_t t = 1 - FARTHEST; t < FARTHEST; t++) {
                if (c + t < 0 || c + t > last) continue;
                const uint8_t *restrict from = in + (size_t)(c + t) * n_inner, steps = (uint8_t)(t < 0 ? -t : t);
                for (size_t i = 0; i < n_inner; i++) {
                    const uint8_t there = from[i] > steps ? from[i] : steps;
                    out[i] = there < out[i] ? there : out[i];
                }
            }
        }
}

/* Replaces a map of 0 and UINT8_MAX by the distances from the zeros, as steps to one of the 26 neighbours; UINT8_MAX
 * from FARTHEST on. tmp: scratch of the same size. */
static void distances(uint8_t *far, uint8_t *tmp, const size_t n[3])
{
    distances_in_rows(far, n[0], n[1] * n[2]);
    distances_across(far, tmp, n[0], n[1], n[2]);
    distances_across(tmp, far, n[0] * n[1], n[2], 1);
}

void scale_find_void(const float *density, float *a, float *b, uint8_t *far, const size_t n[3])
{
    size_t n_voxel = n[0] * n[1] * n[2];
    memcpy(a, density, n_voxel * sizeof *a);
    scale_blur(a, b, n, MATERIAL_SIGMA);
    for (size_t i = 0; i < n_voxel; i++) far[i] = a[i] > MATERIAL || !(fabsf(a[i]) > 1e-6f) ? 0 : UINT8_MAX;
    distances(far, (uint8_t *)b, n);
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

/* Second differences along all three axes at once of a row without its ends; p: value before the row's first one in
 * the row and the slice before. */
static void difference_row(const float *p, const size_t n[3], float *restrict response)
{
    static const float d2[3] = {1.0f, -2.0f, 1.0f};
    memset(response, 0, (n[0] - 2) * sizeof *response);
    for (size_t m = 0; m < 27; m++) {
        const float *from = p + (m / 9 * n[1] + m / 3 % 3) * n[0] + m % 3, w = d2[m % 3] * d2[m / 3 % 3] * d2[m / 9];
        for (size_t i = 0; i + 2 < n[0]; i++) response[i] += w * from[i];
    }
}

double scale_noise_of_voxels(const float *a, const size_t n[3])
{
    float response[SCALE_EDGE];
    size_t count = 0;
    double sum = 0.0;
    for (size_t k = 1; k + 1 < n[2]; k++)
        for (size_t j = 1; j + 1 < n[1] && n[0] > 2; j++, count += n[0] - 2) {
            difference_row(a + ((k - 1) * n[1] + j - 1) * n[0], n, response);
            for (size_t i = 0; i + 2 < n[0]; i++) sum += (double)(response[i] * response[i]);
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
