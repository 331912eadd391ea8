#include "renderer/glint/wave_height.h"

#include <math.h>
#include <stdlib.h>

/* The wavelength and xi_3 of wave_height_rest. */
#define REST_UM 0.5
#define REST_XI_3 2

/* Derivative of a row or column of a periodic field at texel k, by central differences of the fourth order. */
static double derivative(const float *field, size_t k, size_t stride, size_t n, double texel_um)
{
    const size_t line = k / stride % n, rest = k - line * stride;
    double f[4];
    for (size_t i = 0; i < 4; i++) {
        static const size_t step[4] = {1, 2, 1, 2};
        const size_t at = i < 2 ? (line + step[i]) % n : (line + n - step[i]) % n;
        f[i] = (double)field[rest + at * stride];
    }
    return (8 * (f[0] - f[2]) - (f[1] - f[3])) / (12 * texel_um);
}

/* E of the square of (a x^3 + 3 b x^2 y + 3 c x y^2 + d y^3) / 6 over normal deviates x, y of variance 1. */
static double third_of(double a, double b, double c, double d)
{
    return (15 * (a * a + d * d) + 27 * (b * b + c * c) + 18 * (a * c + b * d)) / 36;
}

status wave_height_curve(struct wave_height *h, struct error *err)
{
    const size_t n = h->n, n2 = n * n;
    const double texel = (double)h->texel_um;
    h->curve_uu = malloc(4 * n2 * sizeof *h->curve_uu);
    if (h->curve_uu == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot curve a height field: out of memory");
    h->curve_uv = h->curve_uu + n2;
    h->curve_vv = h->curve_uv + n2;
    h->third2 = h->curve_vv + n2;
    for (size_t k = 0; k < n2; k++) {
        h->curve_uu[k] = (float)derivative(h->slope_u, k, 1, n, texel);
        h->curve_uv[k] = (float)derivative(h->slope_v, k, 1, n, texel);
        h->curve_vv[k] = (float)derivative(h->slope_v, k, n, n, texel);
    }
    for (size_t k = 0; k < n2; k++)
        h->third2[k] =
            (float)third_of(derivative(h->curve_uu, k, 1, n, texel), derivative(h->curve_uv, k, 1, n, texel),
                            derivative(h->curve_uv, k, n, n, texel), derivative(h->curve_vv, k, n, n, texel));
    return STATUS_OK;
}

double wave_height_rest(const struct wave_height *h, double sigma_um)
{
    const size_t n2 = h->n * h->n;
    double sum = 0;
    for (size_t k = 0; k < n2; k++) sum += (double)h->third2[k];
    return pow(2 * M_PI * REST_XI_3 / REST_UM * pow(sigma_um, 3), 2) * sum / (double)n2;
}
