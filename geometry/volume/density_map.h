/* Finds the scanner values of void and of solid fiber from the histogram, maps densities, and measures the noise of
 * the scan. */
#ifndef SELVEDGE_GEOMETRY_DENSITY_MAP_H
#define SELVEDGE_GEOMETRY_DENSITY_MAP_H

#include "base/thread_pool.h"
#include "geometry/volume/volume.h"

#include <stdbool.h>

struct density_modes {
    double low; /* scanner value of void: the lower mode */
    /* of solid material: the 90 % quantile of the values above the threshold, but at least the upper mode */
    double high;
    double half;      /* midway between the two modes, where surfaces are */
    double threshold; /* Otsu's, between the modes */
    double
        separability; /* between-class over total variance, 0..1: 0.64 for one Gaussian, over 0.8 for two clear modes */
};

/* Finds the modes from the values of v averaged over 3 x 3 x 3 voxels, which divides the noise by 5 so that the
 * modes separate, at up to about 4 million places; voxels at VOLUME_OUTSIDE are left out. Uses Otsu's threshold
 * (1979), then the peaks on either side. STATUS_INVALID, field OPTION_SCAN_FILES: NaN or infinite voxels (the first
 * is named), a constant volume, or fewer than 1000 places. */
status density_modes_find(const struct volume *v, struct density_modes *m, struct error *err);

/* Otsu's threshold of n finite values. Returns false if they are all the same. */
bool density_threshold(const float *value, size_t n, double *threshold);

/* Maps each value to density = clamp((value - low) / (high - low), 0, 1), and VOLUME_OUTSIDE to 0. Clamped noise is
 * symmetric about 1/2, so surfaces at half density do not move. STATUS_INVALID, field OPTION_DENSITY_HIGH, if high
 * <= low. */
status density_map_apply(struct volume *v, double low, double high, struct thread_pool *pool, struct error *err);
/* The same with a clamp at -1 and 2, which leaves all but the strongest noise as it is. */
status density_map_wide(struct volume *v, double low, double high, struct thread_pool *pool, struct error *err);

/* Returns the standard deviation of the noise over the step from low to high, the values of void and material (0 and 1
 * in a volume that is mapped, clamped or not), from where the 3 x 3 x 3 mean lies outside of 0.15 .. 0.85 of the step.
 * It comes from the median distance from low of values above it in void, and from high of values below it in material:
 * up to 100,000 values, beginning at the lowest slices. 0 if there are hardly any such values, NaN if memory is out. */
double density_noise_sd(const struct volume *v, double low, double high);

#endif
