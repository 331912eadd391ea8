/* Part "analytic" of bench_fit: both methods with their own budgets on the analytic cloth (fake_estimator.h). It takes
 * seconds. */
#include "base/catalogue/method_catalogue.h"
#include "tests/bench/fit_bench.h"
#include "tests/support/cloth/fit_fabrics.h"
#include "tests/support/tracer/fake_estimator.h"

#include <stdio.h>
#include <stdlib.h>

enum { N_SEED = 10 };

static void fit_analytic(const char *method, uint64_t seed, struct fit_curve *c)
{
    struct fake_cloth f;
    struct observation_set o;
    struct fit_parameter parameter[FAKE_N_PARAM];
    struct fit_result r;
    struct error err = {0};
    double truth[FAKE_N_PARAM];
    fake_cloth_init(&f, seed, FAKE_N_FIT);
    struct estimator e = fake_estimator(&f);
    fake_param_set(fit_fabric_find("gabardine")->truth, truth);
    observation_set_init(&o);
    fit_check(fake_observe(&f, truth, 0.005, seed, &o), &err);
    for (size_t p = 0; p < FAKE_N_PARAM; p++)
        parameter[p] = (struct fit_parameter){fake_param[p].lower, fake_param[p].upper, fake_param[p].start, false};
    const struct fit_problem problem = {.n_param = FAKE_N_PARAM,
                                        .info = fake_param,
                                        .parameter = parameter,
                                        .observation = &o,
                                        .estimator = &e,
                                        .report = bench_on_step,
                                        .report_context = c};
    c->n = 0;
    fit_check(descent_find(method)->run(&problem, &r, &err), &err);
    for (size_t i = 0; i <= c->n; i++) /* the result is the last point: the published method returns its best run */
        printf("{\"name\":\"fit.analytic.%s\",\"value\":%.5g,\"unit\":\"1\",\"better\":\"lower\",\"paths\":%.6g,"
               "\"seed\":%d}\n",
               method, fake_rel_rms(&f, 0, FAKE_N_FIT, i < c->n ? c->param[i] : r.param, truth),
               i < c->n ? c->paths[i] : (double)r.n_path, (int)seed);
    observation_set_release(&o);
}

void bench_analytic(void)
{
    struct fit_curve *c = calloc(1, sizeof *c);
    if (c == NULL) exit(1);
    for (uint64_t seed = 1; seed <= N_SEED; seed++) {
        fit_analytic(method_gauss_newton.id, seed, c);
        fit_analytic(method_published_sgd.id, seed, c);
    }
    free(c);
}
