/* A fit of the analytic cloth (fake_estimator.h) with the options of a job: ties, priors, nuisance terms, several
 * starts. */
#ifndef SELVEDGE_TESTS_FIT_FIXTURE_H
#define SELVEDGE_TESTS_FIT_FIXTURE_H

#include "optimizer/fit/descent/fit_run.h"
#include "tests/support/tracer/fake_estimator.h"

/* True parameters in file units. In the grey set the channels of a colour are equal, so that they can be tied. */
extern const double fit_fixture_grey[FAKE_N_PARAM], fit_fixture_mid_range[FAKE_N_PARAM];

struct fit_fixture {
    struct fake_cloth cloth;
    struct estimator estimator;
    struct observation_set observation;
    struct fit_parameter parameter[FAKE_N_PARAM];
    struct fit_problem problem;
    struct fit_option option;
    double truth[FAKE_N_PARAM];
    size_t n_reported;
    double last_gain;
};

/* exact: no Monte-Carlo noise. rel_noise: relative error of the photographs. */
void fit_fixture_init(struct fit_fixture *x, const double *file_unit, uint64_t seed, bool exact, double rel_noise);
void fit_fixture_release(struct fit_fixture *x);
/* Fits with gauss_newton; fails the test when that fails, or when a reported step is not finite or out of bounds. */
void fit_fixture_run(struct fit_fixture *x, struct fit_result *r);
/* Ties the channels of each colour to the first of them. */
void fit_fixture_tie_colours(struct fit_option *o);

#endif
