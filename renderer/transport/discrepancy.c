#include "renderer/transport/discrepancy.h"

#include <math.h>

static double angle_of(double cosine) { return acos(fmin(fmax(cosine, -1.0), 1.0)); }

void discrepancy_coordinates(double cos_light, double cos_camera, double cos_between, double x[DISCREPANCY_COORDINATES])
{
    const double light = angle_of(cos_light), camera = angle_of(cos_camera);
    const double cos_difference = sqrt(fmax(0.5 * (1.0 + cos_between), 1e-12)); /* half of |light + camera| */
    x[0] = angle_of(0.5 * (cos_light + cos_camera) / cos_difference);
    x[1] = angle_of(cos_difference);
    x[2] = light * light + camera * camera;
    x[3] = fmax(light, camera);
}

double discrepancy_kernel(const double scale[DISCREPANCY_COORDINATES], const double x[DISCREPANCY_COORDINATES],
                          const double y[DISCREPANCY_COORDINATES])
{
    double square = 0.0;
    for (size_t a = 0; a < DISCREPANCY_COORDINATES; a++) {
        const double d = (x[a] - y[a]) / scale[a];
        square += d * d;
    }
    return exp(-0.5 * square);
}

void discrepancy_factor(const struct discrepancy *d, double cos_light, double cos_camera, double cos_between,
                        double factor_rgb[3])
{
    double x[DISCREPANCY_COORDINATES], sum[3] = {0.0, 0.0, 0.0};
    const size_t n = cos_light > 0.0 && cos_camera > 0.0 ? d->n : 0;
    if (n > 0) discrepancy_coordinates(cos_light, cos_camera, cos_between, x);
    for (size_t k = 0; k < n; k++) {
        const double near = discrepancy_kernel(d->scale, x, d->place[k]);
        for (size_t c = 0; c < 3; c++) sum[c] += near * d->weight[k][c];
    }
    for (size_t c = 0; c < 3; c++) factor_rgb[c] = exp(fmin(fmax(sum[c], -DISCREPANCY_MOST), DISCREPANCY_MOST));
}
