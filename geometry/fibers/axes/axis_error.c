#include "geometry/fibers/axes/axis_error.h"

#include <math.h>

enum { N_BIN = 64, N_WAVE = 512 };
/* Stiffness over information, logarithm: first bin and width. */
static const double FIRST = -7.0, WIDTH = 0.4;

/* Integrals of the spectra of position and direction for a stiffness, over v. c: correlation of neighbouring bends. */
static void integrate(double information, double stiffness, double c, double variance[2])
{
    const double step = M_PI / N_WAVE;
    variance[0] = variance[1] = 0.0;
    for (int i = 0; i < N_WAVE; i++) {
        const double k = step * (i + 0.5), bend = 2.0 - 2.0 * cos(k);
        const double penalty = stiffness * bend * bend * (1.0 + c * c - 2.0 * c * cos(k)) / (1.0 - c * c);
        const double spectrum = step / M_PI / (information + penalty);
        variance[0] += spectrum;
        variance[1] += k * k * spectrum;
    }
}

void axis_errors(const struct axis_data *data, const double *stiffness, size_t n, double *position_se,
                 double *direction_se_rad)
{
    const double noise = fmax(data->noise, data->residual);
    size_t count[N_BIN] = {0};
    double position = 0.0, direction = 0.0, independent = 0.0;
    for (size_t i = 0; i < n; i++) {
        const double at = (log(stiffness[i] / data->information) - FIRST) / WIDTH;
        count[(size_t)fmin(fmax(at, 0.0), N_BIN - 1)]++;
    }
    for (size_t b = 0; b < N_BIN; b++) {
        if (count[b] == 0) continue;
        const double share = (double)count[b] / (double)n,
                     stiff = data->information * exp(FIRST + WIDTH * ((double)b + 0.5));
        double measured[2], single[2];
        integrate(data->slope * data->information, stiff, data->correlation, measured);
        integrate(data->information, stiff, 0.0, single);
        position += share * noise * measured[0];
        direction += share * noise * measured[1];
        independent += share * data->residual * single[1];
    }
    *position_se = sqrt(position);
    *direction_se_rad = sqrt(fmax(direction, independent));
}
