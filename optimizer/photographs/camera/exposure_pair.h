/* The ratio of the light of two exposures of one view, by what both show.
 *
 * In small blocks where the longer exposure is not saturated, the ratio of the sums over both pictures, weighted by
 * the camera's noise. Ratios of sums have no bias by noise. One half of a block's pixels decides whether the other half
 * is used, so a sample's own noise never decides. The variance of a ratio is the scatter over an 8 x 8 grid of the
 * picture, which contains noise, flicker and movement. The level of black is taken as uncertain by half a step of the
 * file's values, or by a tenth with a record of the camera's noise. */
#ifndef SELVEDGE_OPTIMIZER_EXPOSURE_PAIR_H
#define SELVEDGE_OPTIMIZER_EXPOSURE_PAIR_H

#include "optimizer/photographs/camera/exposure_merge.h"

/* ln of the light of the shorter over the longer exposure, less the same by stated times. */
struct exposure_pair {
    size_t shorter, longer;
    double value, var; /* var INFINITY: not comparable */
    double channel[3], channel_var[3];
    double uneven; /* standard deviation over the picture beyond noise */
};

/* Compares the n - 1 neighbours in the order of stated times. STATUS_INVALID, naming the exposures: the ratios of the
 * channels differ, so the files were balanced differently. STATUS_NO_MEMORY. */
status exposure_pairs_compare(const struct exposure_set *e, struct exposure_pair pair[EXPOSURE_MAX], struct error *err);

#endif
