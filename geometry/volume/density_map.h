/* Which scanner values mean "no material" and "solid fiber", found from the histogram, and the noise of the scan. */
#ifndef SELVEDGE_GEOMETRY_DENSITY_MAP_H
#define SELVEDGE_GEOMETRY_DENSITY_MAP_H

#include "base/thread_pool.h"
#include "geometry/volume/volume.h"

struct density_modes {
    double low;  /* scanner value of void: the lower mode */
    double high; /* of solid material: 90 % of the values above the threshold are lower, but not under the upper mode */
    double half; /* midway between the two modes, where surfaces are */
    double threshold; /* Otsu's, between them */
    double
        separability; /* between-class over total variance, 0..1: 0.64 for one Gaussian, above 0.8 for two clear modes */
};

/* From the values of v averaged over 3 x 3 x 3 voxels (which brings the noise down 5-fold, so that modes part) at up to about
 * 4 million places; cells at VOLUME_OUTSIDE are left out. Otsu's threshold (1979), then the peaks of either side.
 * STATUS_INVALID, field OPTION_SCAN_FILES: NaN or infinite voxels (the first is named), constant volume, less than 1000 such places. */
status density_modes_find(const struct volume *v, struct density_modes *m, struct error *err);

/* density = clamp((value - low) / (high - low), 0, 1), cells at VOLUME_OUTSIDE 0. Clamping noise is symmetric about 1/2, so
 * surfaces at half density stay where they are. STATUS_INVALID, field OPTION_DENSITY_HIGH, when high <= low. */
status density_map_apply(struct volume *v, double low, double high, struct thread_pool *pool, struct error *err);

/* Standard deviation of the mapped density where the 3 x 3 x 3 mean is below 0.15 or above 0.85, from the median distance to 0 or 1 of what
 * was not clamped: up to 100,000 values, from the lowest slices on. 0 where there are hardly any, NaN without memory. */
double density_noise_sd(const struct volume *v);

#endif
