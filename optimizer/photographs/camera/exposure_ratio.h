/* Exposure times of one view, measured by the light that its exposures have in common.
 *
 * Cameras round the times that they state (1/60 s is 1/64 s) and shutters keep them to a few percent, which leaves
 * steps in merged pictures. Neighbours in the order of times are compared: in small blocks where the longer exposure is
 * not saturated, the ratio of the sums over both pictures, weighted by the camera's noise. Ratios of sums have no bias
 * by noise. One half of a block's pixels decides whether the other half is used, so a sample's own noise never decides.
 * The variance of a ratio is the scatter over an 8 x 8 grid of the picture, which contains noise, flicker and movement.
 * The level of black is taken as uncertain by half a step of the file's values, or by a tenth with a record of the
 * camera's noise.
 *
 * One exposure keeps its stated time: the one whose time the caller ranks lowest, and of equal ranks the longest. The
 * others are fitted together, with a prior of 5 % about the stated times, which determines exposures that have no light
 * in common with another. */
#ifndef SELVEDGE_OPTIMIZER_EXPOSURE_RATIO_H
#define SELVEDGE_OPTIMIZER_EXPOSURE_RATIO_H

#include "optimizer/photographs/camera/exposure_merge.h"

struct exposure_ratio {
    size_t i_scale;                               /* the exposure that keeps its stated time */
    double t_s[EXPOSURE_MAX];                     /* fitted */
    double log_error[EXPOSURE_MAX][EXPOSURE_MAX]; /* of ln t_s[i] by independent causes [k] of one standard deviation */
    char warning[400];                            /* "", or why the stated times or the pictures are doubtful */
};

/* rank: NULL for equal ranks. STATUS_INVALID, naming the exposures: the light of one is more than 1.25 times the
 * prediction by the others and the stated times, or less than that over 1.25; the ratios of the channels differ, so the
 * files were balanced differently. */
status exposure_ratio_fit(const struct exposure_set *e, const double *rank, struct exposure_ratio *r,
                          struct error *err);
/* Standard error of ln t_s[i]. */
double exposure_ratio_error(const struct exposure_ratio *r, size_t i);

#endif
