#include "geometry/fibers/axes/axis_error.h"

#include <math.h>

enum { N_BIN = 64, N_WAVE = 512 };
/* Stiffness over information, logarithm: first bin and width. */
static const double FIRST = -7.0, WIDTH = 0.4;

/* Variances of position and direction for a stiffness, over v. */
static void integrate(const struct axis_data *data, double stiffness, double variance[2])
{
    const double c = data->correlation, step = M_PI / N_WAVE;
    variance[0] = variance[1] = 0.0;
    for (int i = 0; i < N_WAVE; i++) {
        const double k = step * (i + 0.5), bend = 2.0 - 2.0 * cos(k);
        const double penalty = stiffness * bend * bend * (1.0 + c * c - 2.0 * c * cos(k)) / (1.0 - c * c);
        const double spectrum = step / M_PI / (data->information + penalty);
        variance[0] += spectrum;
        variance[1] += k * k * spectrum;
    }
}

void axis_errors(const struct axis_data *data, const double *stiffness, size_t n, double *position_se,
                 double *direction_se_rad)
{
    size_t count[N_BIN] = {0};
    double sum[2] = {0.0, 0.0}, variance[2];
    for (size_t i = 0; i < n; i++) {
        const double at = (log(stiffness[i] / data->information) - FIRST) / WIDTH;
        count[(size_t)fmin(fmax(at, 0.0), N_BIN - 1)]++;
    }
    for (size_t b = 0; b < N_BIN; b++) {
        if (count[b] == 0) continue;
        integrate(data, data->information * exp(FIRST + WIDTH * ((double)b + 0.5)), variance);
        for (int i = 0; i < 2; i++) sum[i] += (double)count[b] * variance[i];
    }
    *position_se = sqrt(data->noise * sum[0] / fmax((double)n, 1.0));
    *direction_se_rad = sqrt(data->noise * sum[1] / fmax((double)n, 1.0));
}
