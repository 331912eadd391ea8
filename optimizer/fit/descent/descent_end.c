#include "optimizer/fit/descent/descent_end.h"

#include <math.h>
#include <string.h>

static status estimate_end(struct descent_run *run, const double *param, const double *x, uint32_t key,
                           struct linear_history *history, struct error *err)
{
    struct fit_step step = {.phase = "final", .param = param};
    status s = descent_estimate(run, param, key, true, err);
    if (s == STATUS_OK) s = descent_report(run, &step, err);
    if (s == STATUS_OK) s = linear_history_append(history, x, run->replica[0], run->replica[1], err);
    return s;
}

status descent_end(struct descent_run *run, const double *param, uint32_t first_key, struct fit_result *result,
                   struct rest_check *end, struct error *err)
{
    const struct fit_problem *problem = run->problem;
    struct linear_history history;
    struct linear_model model = {0};
    double x[FIT_MAX_PARAM];
    linear_history_init(&history, problem->observation, run->coordinate, problem->n_param);
    status s = linear_model_init(&model, 3 * problem->observation->n, problem->n_param, err);
    for (size_t p = 0; p < problem->n_param; p++) x[p] = coordinate_from_param(&run->coordinate[p], param[p]);
    for (uint32_t k = 0; k < DESCENT_N_END && s == STATUS_OK; k++)
        s = estimate_end(run, param, x, first_key + k, &history, err);
    if (s == STATUS_OK) s = linear_model_pool(&model, &history, x, err);
    if (s == STATUS_OK) {
        memcpy(result->param, param, problem->n_param * sizeof *param);
        result->n_step = run->n_step;
        result->n_path = run->n_path_total;
        result->wall_s = run->wall_s;
        result->objective.value = linear_model_objective(&model, &result->objective.se);
        result->objective.rel_rms = sqrt(fmax(0.0, result->objective.value) / (double)model.n_row);
        uncertainty_compute(&model, run->coordinate, run->fixed, &result->uncertainty);
        s = rest_check_compute(run, &model, result->objective.value, end, err);
    }
    if (s == STATUS_OK)
        s = cross_validation_compute(&model, problem->observation, run->coordinate, run->fixed, problem->discrepancy,
                                     &result->cross_validation, err);
    linear_model_release(&model);
    linear_history_release(&history);
    return s;
}
