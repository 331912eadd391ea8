#include "tests/bench/fit_bench.h"

#include "optimizer/fit/descent/estimate_journal.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const struct bench_model_name bench_model[BENCH_N_MODEL] = {{"two_lobe", "two_lobe.v1"},
                                                            {"microflake", "microflake.v1"},
                                                            {"two_lobe_volume", "phase_two_lobe.v1"},
                                                            {"two_lobe_balanced", "two_lobe_balanced.v1"}};

bool bench_takes_model(const struct bench *b, size_t k)
{
    return b->model == NULL || strcmp(b->model, bench_model[k].name) == 0;
}

bool bench_has_model(const char *name)
{
    for (size_t k = 0; k < BENCH_N_MODEL; k++)
        if (name == NULL || strcmp(name, bench_model[k].name) == 0) return true;
    return false;
}

void bench_print(const char *of, const char *what, double value, const char *unit, const char *better)
{
    printf("{\"name\":\"fit.%s%s%s\",\"value\":%.6g,\"unit\":\"%s\",\"better\":\"%s\"}\n", of, what[0] ? "." : "", what,
           value, unit, better);
    fflush(stdout);
}

status bench_on_step(void *context, const struct fit_step *step, struct error *err)
{
    (void)err;
    struct fit_curve *c = context;
    if (c->n == BENCH_MAX_STEP) return STATUS_OK;
    c->wall_s[c->n] = step->wall_s;
    c->paths[c->n] = (double)step->n_path_total;
    c->objective[c->n] = step->objective.value;
    memcpy(c->param[c->n++], step->param, step->n_param * sizeof *step->param);
    return STATUS_OK;
}

void bench_run_fit(const struct fit_phantom *f, const char *method, uint64_t seed, uint64_t budget,
                   const char *journal_file, struct fit_result *r, struct fit_curve *curve)
{
    struct error err = {0};
    struct estimate_journal *journal = NULL;
    struct fit_parameter parameter[FIT_MAX_PARAM];
    struct configuration *configuration = trace_configurations(&f->fitted);
    struct trace_estimator trace = {
        .request = {.input = {.scene = {f->cloth.scene, f->cloth.has_volume ? &f->cloth.volume_scene : NULL},
                              .model = &f->model},
                    .configuration = configuration,
                    .n_configuration = f->fitted.n,
                    .seed = seed},
        .pool = f->pool};
    const struct estimator live = trace_estimator(&trace);
    struct estimator estimator = live;
    if (journal_file != NULL) {
        fit_check(estimate_journal_open(journal_file, fit_phantom_fingerprint(f), &live, NULL, NULL, &journal, &err),
                  &err);
        estimator = estimate_journal_estimator(journal);
    }
    for (size_t p = 0; p < f->model.n_param; p++) {
        const struct param_info *info = &f->model.param[p];
        parameter[p] = (struct fit_parameter){info->lower, info->upper, info->start, info->kind == PARAM_DENSITY};
    }
    struct fit_curve own = {0};
    if (curve == NULL) curve = &own;
    curve->n = 0;
    curve->n_param = f->model.n_param;
    const struct fit_problem problem = {.n_param = f->model.n_param,
                                        .info = f->model.param,
                                        .parameter = parameter,
                                        .observation = &f->fitted,
                                        .estimator = &estimator,
                                        .path_budget = budget,
                                        .report = bench_on_step,
                                        .report_context = curve};
    fit_check(descent_find(method)->run(&problem, r, &err), &err);
    estimate_journal_close(journal);
    free(configuration);
}

void bench_print_fit(const struct fit_phantom *f, const struct fit_result *r)
{
    fprintf(stderr, "  %s after %zu steps, %.3g paths, %.1f s (%.0f k paths/s), objective %.4g: %s\n",
            r->converged ? "converged" : "NOT converged", r->n_step, (double)r->n_path, r->wall_s,
            1e-3 * (double)r->n_path / r->wall_s, r->objective.value, r->reason);
    for (size_t p = 0; p < f->model.n_param; p++) {
        const struct param_info *info = &f->model.param[p];
        fprintf(stderr, "  %-18s %9.4f +- %-8.4f true %9.4f%s%s\n", info->name, param_to_file_unit(info, r->param[p]),
                param_to_file_unit(info, r->uncertainty.se_param[p]), param_to_file_unit(info, f->truth[p]),
                r->uncertainty.at_bound[p] ? " at bound" : "", r->uncertainty.determined[p] ? "" : " undetermined");
    }
}

void bench_keep_truth_inside(struct fit_phantom *f)
{
    for (size_t p = 0; p < f->model.n_param; p++) /* rounded tables can be outside of a bound */
        f->truth[p] = fmin(fmax(f->truth[p], f->model.param[p].lower), f->model.param[p].upper);
}

void bench_photograph(const struct bench *b, struct fit_phantom *f)
{
    fit_phantom_photograph(
        f, &(struct fit_photography){.n_path = b->photograph_paths, .noise = BENCH_NOISE, .noise_seed = 1});
}
