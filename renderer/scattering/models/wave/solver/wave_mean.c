#include "renderer/scattering/models/wave/solver/wave_mean.h"

#include <math.h>

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

/* The waves that are solved for. Of an outline with a mirror, one of each mirrored pair stands for both. */
struct turns {
    size_t n;
    double angle_rad[N_TURN], range[N_TURN][2], weight[N_TURN];
};

static void choose_turns(const struct wave_outline *o, bool symmetric, struct turns *turns)
{
    turns->n = symmetric ? (N_TURN + 1) / 2 : N_TURN;
    for (size_t w = 0; w < turns->n; w++) {
        turns->angle_rad[w] = 2 * M_PI * (double)w / N_TURN;
        turns->weight[w] = symmetric && w > 0 ? 2 : 1;
        wave_outline_extent(o, turns->angle_rad[w], turns->range[w]);
    }
}

/* Adds the power in one direction to that by the angle from straight on. t: amplitudes by exitant and incident field
 * and wave. */
static void add_direction(const struct turns *turns, size_t i_direction, double kappa, const double complex *t,
                          double *power)
{
    for (size_t w = 0; w < turns->n; w++) {
        const size_t i = (i_direction + N - w * PER_TURN) % N;
        const double complex shadow =
            wave_shadow_amplitude(kappa, turns->range[w], remainder(2 * M_PI * (double)i / N, 2 * M_PI));
        for (size_t pair = 0; pair < WAVE_N_FIELD * WAVE_N_FIELD; pair++) {
            const bool same = pair / WAVE_N_FIELD == pair % WAVE_N_FIELD;
            const double complex left = t[pair * turns->n + w] - (same ? shadow : 0);
            power[i] += turns->weight[w] / WAVE_N_FIELD * (creal(left) * creal(left) + cimag(left) * cimag(left));
        }
    }
}

static status check_angles(const struct oblique_problem *p, struct error *err)
{
    double farthest = 0;
    for (int i = 0; i < 360; i++)
        farthest = fmax(farthest, cabs(wave_outline_at(p->outline, i * M_PI / 180, NULL, NULL)));
    const double most = (N - WAVE_MEAN_N_EXACT) / 2.4; /* some waves more reach beyond k times the distance */
    if (p->k * farthest < most) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, "k", "the wave number %g times the size %g is above %.0f", p->k,
                           farthest, most);
}

/* Means over the solved waves. */
static void take_mean(const struct oblique_solver *s, const struct turns *turns, double kappa, struct wave_mean *mean)
{
    double power[N] = {0}, width = 0, absorbed = 0, extinguished = 0, sum = 0;
    double complex t[WAVE_N_FIELD * WAVE_N_FIELD * N_TURN];
    for (size_t w = 0; w < turns->n; w++) {
        width += turns->weight[w] * (turns->range[w][1] - turns->range[w][0]);
        for (int field = 0; field < WAVE_N_FIELD; field++) {
            const double weight = turns->weight[w] / WAVE_N_FIELD;
            absorbed += weight * oblique_solver_absorption(s, (enum wave_field)field, w);
            extinguished += weight * oblique_solver_extinction(s, (enum wave_field)field, w);
        }
    }
    for (size_t j = 0; j < N; j++) {
        oblique_solver_towards(s, 2 * M_PI * (double)j / N, t);
        add_direction(turns, j, kappa, t, power);
    }
    for (int i = 0; i < N; i++) sum += 4 / kappa / N * power[i];
    mean->absorbed = absorbed / (sum + absorbed);
    mean->met = (sum + absorbed) / width;
    mean->extinction = extinguished / width;
    for (int i = 0; i < N; i++) mean->density[i] = (power[i] + power[(N - i) % N]) / (M_PI * kappa * (sum + absorbed));
}

status wave_mean_over_turns(const struct oblique_problem *problem, struct wave_mean *mean, struct error *err)
{
    struct oblique_solver *s = NULL;
    struct turns turns;
    status st = check_angles(problem, err);
    if (st == STATUS_OK) st = oblique_solver_new(problem, &s, err);
    if (st != STATUS_OK) return st;
    choose_turns(problem->outline, oblique_solver_is_symmetric(s), &turns);
    st = oblique_solver_solve(s, turns.angle_rad, turns.n, err);
    if (st == STATUS_OK) take_mean(s, &turns, problem->k * cos(problem->theta_rad), mean);
    oblique_solver_free(s);
    return st;
}
