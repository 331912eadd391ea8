/* Estimates of mean radiance (estimate.h). */
#ifndef SELVEDGE_RENDERER_RADIANCE_ESTIMATE_H
#define SELVEDGE_RENDERER_RADIANCE_ESTIMATE_H

#include "renderer/scattering/scattering.h"

#include <stdint.h>

enum { ESTIMATE_MAX_PARTNER = 15 };
/* An earlier configuration that was estimated from the same camera paths. correlation: covariance of the two means over
 * the product of their standard deviations, both summed over the channels; in [-1, 1]. */
struct estimate_partner {
    uint32_t configuration;
    float correlation;
};

/* The estimate of one configuration: rgb means in radiance units. If the configuration has contrast_cells, `mean` is
 * its contrast; if it has n_rotation, `mean` is the mean over its rotations. */
struct estimate {
    double mean[3], var[3];              /* var: of the mean */
    double jac[3 * SCATTERING_MAX_FLAT]; /* d mean[c] / d flat param p at [c * n_flat + p], by internal unit, with
                                            n_flat = n_param of the model * number of sets */
    double jac_var[3 * SCATTERING_MAX_FLAT];
    uint64_t n_path, n_bounce;
    uint32_t n_partner; /* a mean over rotations may have more than fit, and lists the first ones */
    struct estimate_partner partner[ESTIMATE_MAX_PARTNER];
};

#endif
