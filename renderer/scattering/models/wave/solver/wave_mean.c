#include "renderer/scattering/models/wave/solver/wave_mean.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PENUMBRA 1.8 /* of the angle x^(-1/3) */

enum { N = WAVE_MEAN_N_ANGLE, N_TURN = WAVE_MEAN_N_TURN, PER_TURN = N / N_TURN };

/* sin(x) / x. */
static double sinc(double x) { return fabs(x) < 1e-4 ? 1 - x * x / 6 : sin(x) / x; }

double complex wave_shadow_amplitude(double k, const double range[2], double d)
{
    const double width = range[1] - range[0], middle = 0.5 * (range[0] + range[1]), q = k * sin(d);
    const double part = d * cbrt(0.5 * k * width) / PENUMBRA;
    return 0.5 * k * exp(-part * part) * width * sinc(0.5 * q * width) * cexp(-I * q * middle);
}

/* Sums over the orientations, by the angle from straight on. */
static void add_amplitudes(const struct wave_solver *s, double k, double (*range)[2], double *power)
{
    for (size_t j = 0; j < N; j++) {
        double complex t[N_TURN];
        wave_solver_towards(s, 2 * M_PI * (double)j / N, t);
        for (size_t w = 0; w < N_TURN; w++) {
            const size_t i = (j + N - w * PER_TURN) % N;
            const double complex left =
                t[w] - wave_shadow_amplitude(k, range[w], remainder(2 * M_PI * (double)i / N, 2 * M_PI));
            power[i] += creal(left) * creal(left) + cimag(left) * cimag(left);
        }
    }
}

static status check_angles(const struct wave_problem *p, struct error *err)
{
    double farthest = 0;
    for (int i = 0; i < 360; i++)
        farthest = fmax(farthest, cabs(wave_outline_at(p->outline, i * M_PI / 180, NULL, NULL)));
    const double most = (N - WAVE_MEAN_N_EXACT) / 2.4; /* some waves more reach beyond k times the distance */
    if (p->k * farthest < most) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, "k", "the wave number %g times the size %g is above %.0f", p->k,
                           farthest, most);
}

status wave_mean_over_turns(const struct wave_problem *problem, struct wave_mean *mean, struct error *err)
{
    struct wave_solver *s = NULL;
    double angle[N_TURN], range[N_TURN][2], width = 0, absorbed = 0, extinguished = 0, sum = 0;
    status st = check_angles(problem, err);
    if (st == STATUS_OK) st = wave_solver_new(problem, &s, err);
    for (int w = 0; w < N_TURN; w++) {
        angle[w] = 2 * M_PI * w / N_TURN;
        wave_outline_extent(problem->outline, angle[w], range[w]);
        width += range[w][1] - range[w][0];
    }
    if (st == STATUS_OK) st = wave_solver_solve(s, angle, N_TURN, err);
    if (st != STATUS_OK) {
        wave_solver_free(s);
        return st;
    }
    memset(mean, 0, sizeof *mean);
    for (size_t w = 0; w < N_TURN; w++) {
        absorbed += wave_solver_absorption(s, w);
        extinguished += wave_solver_extinction(s, w);
    }
    add_amplitudes(s, problem->k, range, mean->density);
    wave_solver_free(s);
    for (int i = 0; i < N; i++) sum += 4 / problem->k / N * mean->density[i];
    mean->absorbed = absorbed / (sum + absorbed);
    mean->met = (sum + absorbed) / width;
    mean->extinction = extinguished / width;
    for (int i = 0; i < N; i++) mean->density[i] *= 2 / (M_PI * problem->k * (sum + absorbed));
    return STATUS_OK;
}
