#include "renderer/glint/wave_height.h"

#include <math.h>
#include <stdlib.h>

/* The wavelength and xi_3 at which the correction is exact. */
#define EXACT_UM 0.5
#define EXACT_XI_3 2

static double bend_of(double kappa, double sigma_um)
{
    return 2 * M_PI * EXACT_XI_3 * sigma_um * sigma_um * kappa / EXACT_UM;
}

/* Principal curvatures at a texel, as differences of the slopes. */
static void curvatures(const struct wave_height *h, size_t i, size_t j, double kappa[2])
{
    const size_t n = h->n, right = j * n + (i + 1) % n, left = j * n + (i + n - 1) % n, up = (j + 1) % n * n + i,
                 down = (j + n - 1) % n * n + i;
    const double per_step = 1 / (2 * (double)h->texel_um);
    const double uu = (double)(h->slope_u[right] - h->slope_u[left]) * per_step,
                 vv = (double)(h->slope_v[up] - h->slope_v[down]) * per_step,
                 uv = (double)(h->slope_v[right] - h->slope_v[left]) * per_step;
    const double mean = 0.5 * (uu + vv), apart = hypot(0.5 * (uu - vv), uv);
    kappa[0] = mean + apart;
    kappa[1] = mean - apart;
}

status wave_height_straighten(struct wave_height *h, double sigma_um, struct error *err)
{
    h->gain = malloc(h->n * h->n * sizeof *h->gain);
    if (h->gain == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot correct a height field: out of memory");
    for (size_t j = 0; j < h->n; j++)
        for (size_t i = 0; i < h->n; i++) {
            double kappa[2], gain = 0, rise_um = 0;
            curvatures(h, i, j, kappa);
            for (int k = 0; k < 2; k++) {
                const double x = bend_of(kappa[k], sigma_um), half = 0.5 * sigma_um * sigma_um * kappa[k];
                rise_um += half * (fabs(x) < 1e-6 ? 1 : atan(x) / x);
                gain += half * kappa[k] * (fabs(x) < 1e-3 ? 1 : log1p(x * x) / (x * x));
            }
            h->height_um[j * h->n + i] += (float)rise_um;
            h->gain[j * h->n + i] = (float)gain;
        }
    return STATUS_OK;
}

double wave_height_bend(const struct wave_height *h, double sigma_um)
{
    double square = 0;
    for (size_t j = 0; j < h->n; j++)
        for (size_t i = 0; i < h->n; i++) {
            double kappa[2];
            curvatures(h, i, j, kappa);
            for (int k = 0; k < 2; k++) square += pow(bend_of(kappa[k], sigma_um), 2);
        }
    return sqrt(square / (2 * (double)(h->n * h->n)));
}
