/* The analytic cloth (fake_estimator.h) with three numbers of its own that are fitted together with the nine scattering
 * parameters:
 *   flatness   1 .. 4, logarithmic: brightens mirrored and darkens other directions
 *   packing    0.3 .. 0.8: acts on the colours like C_TT, with a small effect of its own (a valley of the objective)
 *   hairs      0 .. 10: no effect at all
 * misfit > 0 adds a pattern over the rows that no parameter can make. */
#ifndef SELVEDGE_TESTS_FAKE_NUMBERS_H
#define SELVEDGE_TESTS_FAKE_NUMBERS_H

#include "optimizer/fit/cloth/cloth_search.h"
#include "tests/support/tracer/fake_estimator.h"

enum { FAKE_N_NUMBER = 3, FAKE_N_UNKNOWN = FAKE_N_PARAM + FAKE_N_NUMBER };

struct fake_numbers {
    struct fake_cloth cloth;
    struct estimator plain;
    struct cloth_estimator numbers;
    struct estimator estimator; /* of all unknowns */
    struct observation_set observation;
    struct param_info info[FAKE_N_UNKNOWN];
    struct fit_parameter parameter[FAKE_N_UNKNOWN];
    struct fit_problem problem;
    struct fit_option option;
    struct cloth_search search;
    double truth[FAKE_N_UNKNOWN];
    size_t n_reported;
};

/* number: true values. noise 1: that of a path tracer; 0: exact means. rel_noise: relative error of the photographs. */
void fake_numbers_init(struct fake_numbers *x, const double number[FAKE_N_NUMBER], uint64_t seed, double noise,
                       double rel_noise, double misfit);
void fake_numbers_release(struct fake_numbers *x);
/* Exact means of row i at all unknowns. */
void fake_numbers_radiance(const struct fake_numbers *x, size_t i, const double *unknown, double rgb[3]);
/* Runs the search; fails the test when that fails. */
void fake_numbers_run(struct fake_numbers *x, struct cloth_search_result *r);

#endif
