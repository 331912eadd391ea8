/* Nonlinear least squares with bounds, for few unknowns: Levenberg 1944 and Marquardt 1963 ("An algorithm for
 * least-squares estimation of nonlinear parameters"), with differences in place of derivatives. An unknown at a bound
 * that its gradient pushes outwards stays there for a step. */
#ifndef SELVEDGE_OPTIMIZER_LEAST_SQUARES_H
#define SELVEDGE_OPTIMIZER_LEAST_SQUARES_H

#include "base/status.h"

#include <stddef.h>

enum { LEAST_SQUARES_MAX_UNKNOWN = 16 };

struct least_squares {
    size_t n_unknown, n_residual;
    const double *lower, *upper; /* n_unknown each */
    void (*residuals)(void *context, const double *x, double *out);
    void *context;
};

/* x: the start, then the best point found. *value: its sum of squares. STATUS_NO_MEMORY. */
status least_squares_run(const struct least_squares *p, double *x, double *value, struct error *err);

#endif
