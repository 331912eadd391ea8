/* The minimum of a function of one variable that is known with noise only: where it is, and how well that is known.
 *
 * A few evenly spaced evaluations bracket it; the others go where they say most about its place: near the vertex of a
 * polynomial fitted to all (of degree 4, or 3 or 2 where there are too few points or its minimum is not sure: a
 * lopsided minimum would be shifted by less), and so far to its sides that the rise stands out of the noise. Weighted
 * least squares; a point may differ from the polynomial by its own error and by 20 % of its rise over the lowest point.
 * So far points have little weight, and near points a weight by their own error. The vertex gets the error that follows
 * from the points' errors, larger by the square root of chi^2 per degree of freedom where the points scatter more than
 * that. A function of the values it is given: the same values, the same search. */
#ifndef SELVEDGE_OPTIMIZER_NOISY_MINIMUM_H
#define SELVEDGE_OPTIMIZER_NOISY_MINIMUM_H

#include "base/status.h"

#include <stdbool.h>
#include <stddef.h>

enum { NOISY_MAX_POINT = 24 };

struct noisy_point {
    double u, f, se; /* se > 0: standard error of f */
};

struct noisy_minimum_option {
    double lower, upper;
    size_t n_first, n_most; /* number of evaluations at first, 4 or more, and in all, at most NOISY_MAX_POINT */
    double tolerance;       /* the search ends when the error of the place is below this */
};

struct noisy_minimum {
    size_t n_point;
    struct noisy_point point[NOISY_MAX_POINT]; /* in the order of evaluation */
    double u, u_se;                            /* place and its error; infinite where nothing is curved */
    double f;                                  /* of the polynomial there */
    double curvature, curvature_se;            /* second derivative */
    bool at_bound;                             /* the minimum is at lower or upper */
    /* The minimum is inside the bounds, its curvature is positive by two standard errors, and its error is below half
     * of the error of a uniform distribution over the range. */
    bool determined;
};

/* evaluate gives f and its standard error at u; an error of it ends the search and is returned. STATUS_INVALID for
 * contradictory options. */
status noisy_minimum_search(const struct noisy_minimum_option *o,
                            status (*evaluate)(void *context, double u, double *f, double *se, struct error *err),
                            void *context, struct noisy_minimum *out, struct error *err);

#endif
