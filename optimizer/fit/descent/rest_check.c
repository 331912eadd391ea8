#include "optimizer/fit/descent/rest_check.h"
#include "optimizer/fit/descent/gauss_newton.h"

#include <math.h>
#include <stdlib.h>

static const double tolerated_share = 0.05, tolerated_rel_rms = 0.005;

status rest_check_compute(const struct descent_run *run, const struct linear_model *model, double f,
                          struct rest_check *check, struct error *err)
{
    struct gauss_newton *g = calloc(1, sizeof *g);
    double dx[N];
    if (g == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot judge the end of a fit: out of memory");
    g->run = *run;
    g->model = *model;
    g->limit_scale = 1.0;
    for (size_t p = 0; p < model->n_param; p++) g->n_free += !run->fixed[p];
    status s = gauss_newton_step(g, dx, err);
    if (s == STATUS_OK) {
        check->promised = g->far_decrease;
        check->noise = fmax(gauss_newton_noise(g), g->noise_decrease);
        check->tolerance = fmax(tolerated_share * f, tolerated_rel_rms * tolerated_rel_rms * (double)model->n_row);
    }
    free(g);
    return s;
}

enum stop_reason rest_check_verdict(const struct rest_check *check)
{
    if (check->promised > fmax(check->tolerance, check->noise)) return STOP_DECREASE_LEFT;
    return check->noise > check->tolerance ? STOP_NOISE : STOP_SCHEDULE;
}
