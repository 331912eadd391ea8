#include "tests/support/descent_fixture.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const double mid_range[FAKE_N_PARAM] = {0.15, 0.08, 0.05, 0.9, 0.6, 0.4, 5.0, 15.0, 20.0};

static status on_step(void *context, const struct fit_step *step, struct error *err)
{
    struct descent_fixture *x = context;
    (void)err;
    assert_int_equal(step->step, x->n_reported);
    if (x->n_reported == 0) x->first = step->objective.value;
    x->last = step->objective.value;
    x->n_reported++;
    assert_true(isfinite(step->objective.value) && step->objective.se > 0.0);
    for (size_t p = 0; p < step->n_param; p++)
        assert_true(step->param[p] >= fake_param[p].lower && step->param[p] <= fake_param[p].upper);
    return STATUS_OK;
}

void descent_fixture_init(struct descent_fixture *x, uint64_t seed, uint64_t path_budget)
{
    memset(x, 0, sizeof *x);
    fake_cloth_init(&x->cloth, seed, FAKE_N_FIT);
    x->estimator = fake_estimator(&x->cloth);
    fake_param_set(mid_range, x->truth);
    observation_set_init(&x->observation);
    assert_int_equal(fake_observe(&x->cloth, x->truth, 0.005, seed, &x->observation), STATUS_OK);
    for (size_t p = 0; p < FAKE_N_PARAM; p++)
        x->parameter[p] = (struct fit_parameter){fake_param[p].lower, fake_param[p].upper, fake_param[p].start, false};
    x->problem = (struct fit_problem){.n_param = FAKE_N_PARAM,
                                      .info = fake_param,
                                      .parameter = x->parameter,
                                      .observation = &x->observation,
                                      .estimator = &x->estimator,
                                      .path_budget = path_budget,
                                      .report = on_step,
                                      .report_context = x};
}

void descent_fixture_run(struct descent_fixture *x, const struct descent_method *method, struct fit_result *result)
{
    struct error err = {0};
    x->n_reported = 0;
    if (method->run(&x->problem, result, &err) != STATUS_OK) fail_msg("%s: %s", method->info->id, err.text);
    assert_int_equal(result->n_step, x->n_reported);
    assert_true(result->reason[0] != '\0' && result->n_path > 0);
}
