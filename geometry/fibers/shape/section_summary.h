/* How the sections of a set of fibers are distributed, for reports. */
#ifndef SELVEDGE_GEOMETRY_SECTION_SUMMARY_H
#define SELVEDGE_GEOMETRY_SECTION_SUMMARY_H

#include "geometry/fibers/fiber_set.h"

enum { SECTION_N_BIN = 20 };

/* Shares and quantiles are by length. NaN where nothing was measured. */
struct section_summary {
    double measured_share; /* of the length with measured sections */
    double ratio_p10, ratio_median, ratio_p90;
    double ratio_se_median, angle_se_median_rad; /* the angle's where the ratio is above FIBER_RATIO_FLAT */
    double flat_share;                           /* of the measured length with a ratio above FIBER_RATIO_FLAT */
    double bin_edge[SECTION_N_BIN + 1];          /* ratios from 1 to 3; the last bin has all above, too */
    double bin_share[SECTION_N_BIN];
    size_t n_varying; /* fibers whose radius varies along them */
    /* Widths of lumens over widths of the fibers, where the scan tells them; share of the length where it does. */
    double lumen_p10, lumen_median, lumen_p90, lumen_se_median, lumen_share;
    /* variation: over the fibers whose radius varies, the mean of the radius' standard deviation along a fiber over its
     * mean radius. variation_se_median: median standard error of this ratio. */
    double variation, variation_se_median;
};

/* shared_se_m: error that all radii share, which is no error of their variation; 0: none. STATUS_NO_MEMORY. */
status section_summary_make(const struct fiber_set *f, double shared_se_m, struct section_summary *out,
                            struct error *err);

#endif
