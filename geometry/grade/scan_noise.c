#include "geometry/grade/scan_noise.h"

#include <math.h>
#include <stdbool.h>

enum { REACH = 4, EDGE = 2 * REACH + 1, MAX_PLACE = 200000, MIN_PLACE = 500 };
/* Void is where the mean over EDGE^3 voxels is not far above the mean of clamped noise, 0.4 sd: a closer bound would
 * leave out void that correlated noise has raised. */
static const double VOID_MEAN_SD = 0.6, VOID_MEAN = 0.005;
static const double LEAST_CORRELATION = 0.02, MOST_BLUR = 5.0;

struct sums {
    double square, product[3];
    size_t n;
};

static bool is_void(const struct volume *v, const size_t x[3], double most)
{
    double sum = 0.0;
    for (size_t k = x[2] - REACH; k <= x[2] + REACH; k++)
        for (size_t j = x[1] - REACH; j <= x[1] + REACH; j++)
            for (size_t i = x[0] - REACH; i <= x[0] + REACH; i++)
                sum += (double)v->density[volume_index(v->n, i, j, k)];
    return sum <= most * EDGE * EDGE * EDGE;
}

static void add_place(const struct volume *v, const size_t x[3], struct sums *s)
{
    const size_t stride[3] = {1, v->n[0], v->n[0] * v->n[1]};
    const float *p = v->density + volume_index(v->n, x[0], x[1], x[2]);
    s->square += (double)(p[0] * p[0]);
    for (int a = 0; a < 3; a++) s->product[a] += 0.5 * (double)(p[0] * (p[stride[a]] + *(p - stride[a])));
    s->n++;
}

/* Returns the correlation c of Gaussian noise whose positive part has this ratio (formula in scan_noise.h). */
static double invert(double ratio)
{
    double low = -1.0, high = 1.0;
    for (int i = 0; i < 60; i++) {
        double c = 0.5 * (low + high), r = (sqrt(1.0 - c * c) + c * (M_PI - acos(c))) / M_PI;
        *(r < ratio ? &low : &high) = c;
    }
    return 0.5 * (low + high);
}

double scan_noise_correlation(const struct volume *v, double noise_sd)
{
    struct sums s = {0};
    size_t step = 1, x[3];
    const double most = VOID_MEAN_SD * noise_sd + VOID_MEAN;
    if (!(noise_sd > 0.0)) return NAN;
    while (volume_n_voxel(v->n) / (step * step * step) > MAX_PLACE) step++;
    for (x[2] = REACH; x[2] + REACH < v->n[2]; x[2] += step) {
        scratch_keep_within(v->space);
        for (x[1] = REACH; x[1] + REACH < v->n[1]; x[1] += step)
            for (x[0] = REACH; x[0] + REACH < v->n[0]; x[0] += step)
                if (is_void(v, x, most)) add_place(v, x, &s);
    }
    if (s.n < MIN_PLACE || !(s.square > 0.0)) return NAN;
    return invert((s.product[0] + s.product[1] + s.product[2]) / (3.0 * s.square));
}

/* Correlation at one voxel of white noise after a sampled Gaussian. */
static double correlation_of(double sd)
{
    double square = 0.0, product = 0.0;
    int reach = (int)ceil(4.0 * sd) + 1;
    for (int i = -reach; i <= reach; i++) {
        double w = exp(-0.5 * i * i / (sd * sd)), next = exp(-0.5 * (i + 1) * (i + 1) / (sd * sd));
        square += w * w;
        product += w * next;
    }
    return product / square;
}

double scan_noise_blur(double correlation)
{
    double low = 0.1, high = MOST_BLUR;
    if (!(correlation > LEAST_CORRELATION)) return 0.0;
    for (int i = 0; i < 40; i++) {
        double sd = 0.5 * (low + high);
        *(correlation_of(sd) < correlation ? &low : &high) = sd;
    }
    return 0.5 * (low + high);
}
