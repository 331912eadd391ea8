/* Ratios of exposures that have no light in common, from other views of the job.
 *
 * A shutter repeats a time better than it keeps the stated one. Two exposures of a view cannot be compared if the
 * longer one is saturated or the shorter one black (exposure_pair.h). Their ratio is then taken from exposures of the
 * same stated times, ISO value and f-number in other views. Its variance is the error of the mean over these views plus
 * the scatter from view to view, which is measured, with a prior of 1 %. */
#ifndef SELVEDGE_OPTIMIZER_EXPOSURE_CARRY_H
#define SELVEDGE_OPTIMIZER_EXPOSURE_CARRY_H

#include "optimizer/photographs/camera/exposure_pair.h"
#include "optimizer/photographs/reader/photograph.h"

#include <stdbool.h>

/* A ratio that was measured in one view. */
struct carried_ratio {
    double shorter_s, longer_s, iso, aperture; /* stated */
    double value, var;                         /* as in struct exposure_pair */
};

struct exposure_carry {
    bool searched; /* the job's views have been compared */
    size_t n, n_allocated;
    struct carried_ratio *ratio;
};

/* Adds the ratios of a view that are known. info: of its first exposure. STATUS_NO_MEMORY. */
status exposure_carry_add(struct exposure_carry *carry, const struct exposure_set *e,
                          const struct photograph_info *info, const struct exposure_pair *pair, struct error *err);
/* Gives the pairs of a view that are not comparable the ratios of others. */
void exposure_carry_fill(const struct exposure_carry *carry, const struct exposure_set *e,
                         const struct photograph_info *info, struct exposure_pair *pair);
void exposure_carry_release(struct exposure_carry *carry);

#endif
