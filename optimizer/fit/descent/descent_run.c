#include "base/option_id.h"
#include "optimizer/fit/descent/descent_methods.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

status descent_check(const struct fit_problem *problem, struct error *err)
{
    if (problem->n_param == 0 || problem->n_param > FIT_MAX_PARAM)
        return error_set(err, STATUS_INVALID, "cannot fit %zu parameters: allowed are 1 to %d", problem->n_param,
                         FIT_MAX_PARAM);
    if (problem->observation->n == 0 || problem->observation->n != problem->estimator->n_configuration)
        return error_set(err, STATUS_INVALID, "cannot fit %zu observations with an estimator of %zu configurations",
                         problem->observation->n, problem->estimator->n_configuration);
    for (size_t p = 0; p < problem->n_param; p++) {
        const struct fit_parameter *k = &problem->parameter[p];
        if (!(k->start >= k->lower && k->start <= k->upper))
            return error_set_field(
                err, STATUS_INVALID, OPTION_START, "parameter '%s' starts at %g: its bounds are %g and %g",
                problem->info[p].name, param_to_file_unit(&problem->info[p], k->start),
                param_to_file_unit(&problem->info[p], k->lower), param_to_file_unit(&problem->info[p], k->upper));
    }
    return STATUS_OK;
}

status descent_run_init(struct descent_run *run, const struct fit_problem *problem, const struct descent_method *method,
                        struct error *err)
{
    *run = (struct descent_run){.problem = problem};
    status s = descent_check(problem, err);
    if (s != STATUS_OK) return s;
    size_t n = problem->observation->n;
    run->path_budget = problem->path_budget > 0 ? problem->path_budget : method->info->default_path_budget;
    run->n_path_expected = fmin(problem->usual_path, (double)run->path_budget);
    run->plain_paths = method->plain_paths;
    run->n_path = calloc(n, sizeof *run->n_path);
    run->replica[0] = calloc(n, sizeof(struct estimate));
    run->replica[1] = calloc(n, sizeof(struct estimate));
    if (run->n_path == NULL || run->replica[0] == NULL || run->replica[1] == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot fit %zu observations: out of memory", n);
    for (size_t p = 0; p < problem->n_param; p++) {
        coordinate_init(&run->coordinate[p], &problem->info[p], problem->parameter[p].lower,
                        problem->parameter[p].upper);
        run->fixed[p] = problem->parameter[p].fixed;
    }
    return STATUS_OK;
}

void descent_run_release(struct descent_run *run)
{
    free(run->n_path);
    free(run->replica[0]);
    free(run->replica[1]);
}

/* Reports the fraction of the fit that n_path paths are. */
static void report_paths(struct descent_run *run, double n_path)
{
    const double expected = run->n_path_expected > 0.0 ? run->n_path_expected : (double)run->path_budget;
    run->fraction = fmax(run->fraction, fmin(1.0, n_path / expected));
    progress_report(run->problem->progress, run->fraction);
}

/* The estimator's progress of one call, as a part of the fit's. */
struct call_progress {
    struct descent_run *run;
    double n_path_call;
};

static void report_call(void *context, double fraction)
{
    const struct call_progress *c = context;
    report_paths(c->run, (double)c->run->n_path_total + fraction * c->n_path_call);
}

status descent_estimate(struct descent_run *run, const double *param, uint32_t iteration, bool want_jacobian,
                        struct error *err)
{
    const struct estimator *e = run->problem->estimator;
    struct call_progress part = {.run = run};
    struct progress progress = {.report = report_call,
                                .context = &part,
                                .cancel = run->problem->progress != NULL ? run->problem->progress->cancel : NULL};
    for (size_t i = 0; i < e->n_configuration; i++) part.n_path_call += (double)run->n_path[i];
    struct estimator_pair pair = {.next = run->replica[1]};
    run->n_path_step = 0;
    for (uint32_t q = 0; q < 2; q++) {
        struct estimator_call call = {
            param,         run->n_path,      iteration, q == 0 ? REPLICA_FIT_A : REPLICA_FIT_B,
            want_jacobian, run->plain_paths, &pair};
        double wall_s = 0.0;
        status s = e->run(e->context, &call, &progress, run->replica[q], &wall_s, err);
        if (s != STATUS_OK) return s;
        run->wall_s += wall_s;
        for (size_t i = 0; i < e->n_configuration; i++) {
            run->n_path_step += run->replica[q][i].n_path;
            run->n_path_total += run->replica[q][i].n_path;
        }
    }
    return STATUS_OK;
}

status descent_report(struct descent_run *run, struct fit_step *step, struct error *err)
{
    step->step = run->n_step++;
    step->wall_s = run->wall_s;
    step->n_path = run->n_path_step;
    step->n_path_total = run->n_path_total;
    step->n_param = run->problem->n_param;
    step->n_configuration = run->problem->observation->n;
    step->replica[0] = run->replica[0];
    step->replica[1] = run->replica[1];
    objective_evaluate(run->problem->observation, run->replica[0], run->replica[1], &step->objective);
    report_paths(run, (double)run->n_path_total);
    return run->problem->report != NULL ? run->problem->report(run->problem->report_context, step, err) : STATUS_OK;
}
