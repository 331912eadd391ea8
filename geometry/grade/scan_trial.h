/* The accuracy that a scan allows: figures of a phantom of the fibers that were traced in it, with its noise and
 * blur. */
#ifndef SELVEDGE_GEOMETRY_SCAN_TRIAL_H
#define SELVEDGE_GEOMETRY_SCAN_TRIAL_H

#include <stdbool.h>
#include <stddef.h>

/* Most voxels that are tried. */
enum { SCAN_TRIAL_VOXELS = 1 << 24 };

struct scan_trial {
    bool made;
    size_t n_voxel[3], n_true, n_found; /* the part of the scan that was tried, its fibers, and those found again */
    double snr;                         /* of the phantom; 0: no noise */
    double scan_noise_sd;               /* of the scan before it was smoothed, over the step from void to material */
    double noise_sd_voxel;              /* of the Gaussian that correlates its noise; 0: white */
    double blur_sd_voxel;
    /* The fibers of the phantom: standard deviation of their radii over the mean; mean ratio of the axes of their
     * sections (1: round) and mean ratio of the lumens' width to the fibers' (0: solid), with standard deviations. All
     * are taken over the length, where the scan was measured, so deviations contain the errors of the measurement. */
    double radius_spread, axis_ratio, axis_ratio_spread, lumen, lumen_spread;
    /* Figures of geometry/phantom/compare.h; NaN if nothing was found. */
    double recall, recall_se, precision, fragments, fragments_se, merges, axis_rms_voxel, direction_mean_deg,
        direction_p95_deg;
    double radius_bias, radius_rms;                           /* of found / true - 1 */
    double lumen_rms;                                         /* of found - true width; NaN for solid fibers */
    double voxel_direction_mean_deg, voxel_direction_p95_deg; /* of compare_directions.h, inside of fibers */
};

#endif
