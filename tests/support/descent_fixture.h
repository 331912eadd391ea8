/* A fit of the analytic cloth (fake_estimator.h) by any method, without a job. */
#ifndef SELVEDGE_TESTS_DESCENT_FIXTURE_H
#define SELVEDGE_TESTS_DESCENT_FIXTURE_H

#include "optimizer/fit/descent/descent.h"
#include "tests/support/tracer/fake_estimator.h"

struct descent_fixture {
    struct fake_cloth cloth;
    struct estimator estimator;
    struct observation_set observation;
    struct fit_parameter parameter[FAKE_N_PARAM];
    struct fit_problem problem;
    double truth[FAKE_N_PARAM], first, last;
    size_t n_reported;
};

/* Sets up a fit in which all parameters are free and start at the model's start. The photographs have mid-range
 * parameters and a relative error of 0.5 %. The caller releases x->observation. */
void descent_fixture_init(struct descent_fixture *x, uint64_t seed, uint64_t path_budget);
/* Runs the method; fails the test when that fails, or when a reported step is not finite or out of bounds. */
void descent_fixture_run(struct descent_fixture *x, const struct descent_method *method, struct fit_result *result);

#endif
