/* The inner problem of a step: a quadratic function within bounds. */
#ifndef SELVEDGE_OPTIMIZER_BOUNDED_QUADRATIC_H
#define SELVEDGE_OPTIMIZER_BOUNDED_QUADRATIC_H

#include "base/status.h"

#include <stddef.h>

/* Minimises g.y + y'Hy/2 over lower <= y <= upper, with lower <= 0 <= upper and a positive semi-definite H (n x n),
 * by nlopt's SLSQP. STATUS_NO_MEMORY; STATUS_NUMERIC when H or g is not finite. */
status bounded_quadratic(const double *hessian, const double *g, const double *lower, const double *upper, size_t n,
                         double *y, struct error *err);

#endif
