/* Exposure times of one view, measured by the light that its exposures have in common.
 *
 * Cameras round the times that they state (1/60 s is 1/64 s) and shutters keep them to a few percent, which leaves
 * steps in merged pictures. Neighbours in the order of times are compared (exposure_pair.h); ratios of exposures that
 * have no light in common come from other views (exposure_carry.h).
 *
 * One exposure keeps its stated time: the one whose time the caller ranks lowest, and of equal ranks the longest. The
 * others are fitted together, with a prior of 5 % about the stated times, which determines exposures that have no light
 * in common with another. */
#ifndef SELVEDGE_OPTIMIZER_EXPOSURE_RATIO_H
#define SELVEDGE_OPTIMIZER_EXPOSURE_RATIO_H

#include "optimizer/photographs/camera/exposure_pair.h"

struct exposure_ratio {
    size_t i_scale;                               /* the exposure that keeps its stated time */
    double t_s[EXPOSURE_MAX];                     /* fitted */
    double log_error[EXPOSURE_MAX][EXPOSURE_MAX]; /* of ln t_s[i] by independent causes [k] of one standard deviation */
    char warning[400];                            /* "", or why the stated times or the pictures are doubtful */
};

/* pair: of exposure_pairs_compare. rank: NULL for equal ranks. STATUS_INVALID, naming the exposure: its light is more
 * than 1.25 times the prediction by the others and the stated times, or less than that over 1.25. */
status exposure_ratio_solve(const struct exposure_set *e, const double *rank, const struct exposure_pair *pair,
                            struct exposure_ratio *r, struct error *err);
/* Compares the exposures and solves. Errors of both. */
status exposure_ratio_fit(const struct exposure_set *e, const double *rank, struct exposure_ratio *r,
                          struct error *err);
/* Standard error of ln t_s[i]. */
double exposure_ratio_error(const struct exposure_ratio *r, size_t i);

#endif
