/* The part of the errors of scattering parameters that comes from uncertain numbers of a cloth, which the fit held
 * fixed.
 *
 * C is the covariance of a joint fit of parameters p and numbers x. S = C_px C_xx^-1 is the shift of the fitted
 * parameters by a shift of the numbers, and S V S' is added to the covariance of p, where V is the covariance of the
 * numbers: C_xx where the parameters belong to the numbers of the joint fit (law of total covariance), or a given one
 * where the fit took other values, such as a scan's, whose errors are known. */
#ifndef SELVEDGE_OPTIMIZER_CARRIED_ERROR_H
#define SELVEDGE_OPTIMIZER_CARRIED_ERROR_H

#include "optimizer/fit/descent/descent.h"

/* Leaves out of u the n_out entries from `first` on: of vectors and of rows and columns of matrices. */
void carried_error_leave_out(const struct uncertainty *u, size_t first, size_t n_out, struct uncertainty *out);

/* Adds S V S' to `out`, which lacks the n_number entries from `first` on that the joint uncertainty has. Standard
 * errors grow in the same proportion. variance: of each number in its fit coordinate, independent of each other; NULL:
 * V = C_xx. Numbers without variance in C are left out. Nothing is added where C_xx cannot be
 * inverted. */
void carried_error_add(const struct uncertainty *joint, size_t first, size_t n_number, const double *variance,
                       struct uncertainty *out);

/* Limits each error to the error of a uniform distribution over the range, and decides which parameters are determined.
 * info, parameter: u->n_param of them. */
void carried_error_limit(const struct param_info *info, const struct fit_parameter *parameter, struct uncertainty *u);

#endif
