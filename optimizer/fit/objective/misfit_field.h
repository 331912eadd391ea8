/* The residuals of a fit at neighbouring directions are alike: a highlight that is too wide is too bright beside its
 * middle everywhere. The misfit is therefore taken as a Gaussian field over the directions of light and camera,
 *
 *   covariance of rows i and j = misfit_var [ s exp(-d_ij^2 / (2 l^2)) + (1 - s) (i = j) ],
 *   d_ij^2 = |light_i - light_j|^2 + |camera_i - camera_j|^2   (unit vectors in the frame of the cloth),
 *
 * common to the three channels, in units of the objective (relative to a row's brightness). misfit_var comes from the
 * fit; the smooth share s and the length l have the largest likelihood of the fitted rows' residuals, whose own noise
 * is added on the diagonal. Where a row is a mean over all rotations of the cloth, directions are compared up to a turn
 * about the normal and a mirroring.
 *
 * The field then gives the variance of the misfit that is still unknown at another configuration: large far from all
 * fitted rows, small beside one. Source: Kennedy and O'Hagan 2001, Bayesian calibration of computer models, section 4.
 * Ownership: plain memory, about 140 kB; not for the stack. Not thread-safe while it is set up. */
#ifndef SELVEDGE_OPTIMIZER_MISFIT_FIELD_H
#define SELVEDGE_OPTIMIZER_MISFIT_FIELD_H

#include "optimizer/photographs/rows/observation.h"
#include "renderer/estimate/estimate.h"

enum { MISFIT_FIELD_MAX_ROW = 128, MISFIT_FIELD_PLACE = 6 };

struct misfit_field {
    size_t n; /* rows; 0: there is no smooth misfit */
    bool all_rotations;
    double misfit_var, smooth_share, length;
    double place[MISFIT_FIELD_MAX_ROW][MISFIT_FIELD_PLACE]; /* unit vectors of light and camera */
    double factor[MISFIT_FIELD_MAX_ROW * MISFIT_FIELD_MAX_ROW];
};

/* Variances of a residual, relative to the row's brightness. */
struct misfit_prediction {
    double smooth_var; /* of the smooth part, as far as the fitted rows do not tell it */
    double rest_var;   /* of the part that is independent at every row */
};

/* o: the fitted rows, radiances only; of more than MISFIT_FIELD_MAX_ROW rows as many are used, evenly spaced. a, b: one
 * estimate per row from independent replicas, as the photographs would show them. */
void misfit_field_init(struct misfit_field *f, const struct observation_set *o, const struct estimate *a,
                       const struct estimate *b, double misfit_var);
void misfit_field_predict(const struct misfit_field *f, const struct configuration *c, struct misfit_prediction *out);

#endif
