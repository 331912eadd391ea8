#include "tests/support/fit_fixture.h"

#include "base/catalogue/method_catalogue.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

const double fit_fixture_grey[FAKE_N_PARAM] = {0.1, 0.1, 0.1, 0.7, 0.7, 0.7, 5.0, 15.0, 30.0};
const double fit_fixture_mid_range[FAKE_N_PARAM] = {0.15, 0.08, 0.05, 0.9, 0.6, 0.4, 5.0, 15.0, 20.0};

static status on_step(void *context, const struct fit_step *step, struct error *err)
{
    struct fit_fixture *x = context;
    (void)err;
    assert_int_equal(step->step, x->n_reported++);
    assert_int_equal(step->n_param, FAKE_N_PARAM);
    assert_true(step->step_length >= 0.0 && step->step_length <= 1.0 + 1e-9 && step->step_limit <= 1.0);
    assert_true(isfinite(step->damping) && isfinite(step->noise) && isfinite(step->decrease));
    for (size_t p = 0; p < step->n_param; p++)
        assert_true(step->param[p] >= fake_param[p].lower && step->param[p] <= fake_param[p].upper);
    if (step->nuisance != NULL) x->last_gain = step->nuisance->value[0];
    return STATUS_OK;
}

void fit_fixture_init(struct fit_fixture *x, const double *file_unit, uint64_t seed, bool exact, double rel_noise)
{
    memset(x, 0, sizeof *x);
    fake_cloth_init(&x->cloth, seed, FAKE_N_FIT);
    x->cloth.noise = exact ? 0.0 : 1.0;
    x->estimator = fake_estimator(&x->cloth);
    fake_param_set(file_unit, x->truth);
    fit_option_init(&x->option);
    observation_set_init(&x->observation);
    assert_int_equal(fake_observe(&x->cloth, x->truth, rel_noise, seed, &x->observation), STATUS_OK);
    for (size_t p = 0; p < FAKE_N_PARAM; p++)
        x->parameter[p] = (struct fit_parameter){fake_param[p].lower, fake_param[p].upper, fake_param[p].start, false};
    x->problem = (struct fit_problem){.n_param = FAKE_N_PARAM,
                                      .info = fake_param,
                                      .parameter = x->parameter,
                                      .observation = &x->observation,
                                      .estimator = &x->estimator,
                                      .path_budget = 2000000,
                                      .report = on_step,
                                      .report_context = x};
}

void fit_fixture_release(struct fit_fixture *x) { observation_set_release(&x->observation); }

void fit_fixture_run(struct fit_fixture *x, struct fit_result *r)
{
    struct error err = {0};
    x->n_reported = 0;
    if (fit_run(descent_find(method_gauss_newton.id), &x->problem, &x->option, r, &err) != STATUS_OK)
        fail_msg("%s: %s", err.field, err.text);
    assert_int_equal(r->n_step, x->n_reported);
}

void fit_fixture_tie_colours(struct fit_option *o)
{
    for (size_t p = 0; p < 6; p++) o->leader[p] = 3 * (p / 3);
}
