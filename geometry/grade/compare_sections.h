/* Compares the sections along reconstructed fibers with the true ones: radius, ratio of axes, turn of the long axis.
 * Also tells whether the stated standard errors are right. */
#ifndef SELVEDGE_GEOMETRY_COMPARE_SECTIONS_H
#define SELVEDGE_GEOMETRY_COMPARE_SECTIONS_H

#include "geometry/fibers/fiber_set.h"

/* Figures over those vertices of found fibers that lie within the radius of a true fiber. A pull is a normalised error,
 * 1 where the stated errors are right: the median of |error| / standard error, divided by 0.6745, which is the median
 * of |x| for a standard normal x. Root mean squares include places where a line follows no fiber. NaN: there are no
 * values. */
struct section_compare {
    size_t n;
    double radius_rms;                 /* of found / true - 1, with the radius at the vertex */
    double mean_radius_rms;            /* the same with the mean radius of the found fiber */
    double radius_bias, radius_pull;   /* mean of found / true - 1 */
    double ratio_bias, ratio_rms;      /* of found / true - 1 */
    double ratio_median, ratio_pull;   /* median of |found / true - 1| */
    double turn_median_deg, turn_pull; /* where the true ratio is above 1.3 */
    /* Errors of the ratio of lumen width to fiber width, found minus true; lumen_share: share of the vertices where the
     * scan shows this ratio. */
    double lumen_rms, lumen_bias, lumen_pull, lumen_share;
};

/* Figures are 0 or NaN where the found set has no sections. STATUS_NO_MEMORY. */
status compare_sections(const struct fiber_set *truth, const struct fiber_set *found, struct section_compare *out,
                        struct error *err);

#endif
