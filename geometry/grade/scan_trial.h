/* What a scan can give: figures of a phantom of the fibers that were traced in it, with its noise and blur. */
#ifndef SELVEDGE_GEOMETRY_SCAN_TRIAL_H
#define SELVEDGE_GEOMETRY_SCAN_TRIAL_H

#include <stdbool.h>
#include <stddef.h>

struct scan_trial {
    bool made;
    size_t n_voxel[3], n_true, n_found; /* the part of the scan that was tried, its fibers, and those found again */
    double snr;                         /* of the phantom; 0: no noise */
    double noise_sd_voxel;              /* of the Gaussian that correlates its noise; 0: white */
    double blur_sd_voxel;
    /* Figures of geometry/phantom/compare.h; NaN if nothing was found. */
    double recall, precision, fragments, merges, axis_rms_voxel, direction_mean_deg, direction_p95_deg;
    double radius_bias, radius_rms;                           /* of found / true - 1 */
    double voxel_direction_mean_deg, voxel_direction_p95_deg; /* of compare_directions.h, inside of fibers */
};

#endif
