/* Near or far field of the fibers in a picture, by how wide its pixels are. */
#ifndef SELVEDGE_OPTIMIZER_SURFACE_FIELD_H
#define SELVEDGE_OPTIMIZER_SURFACE_FIELD_H

#include "optimizer/report/findings/report.h"

/* Returns the number of mean fiber diameters that a pixel of `pixel_m` covers. Fibers weigh as much as they show, by
 * their length and diameter. 0 without fibers. */
double surface_field_coverage(const struct fiber_set *fiber, double pixel_m);

/* The model by which picture i renders the best model of the job. That is the model itself. But if the picture asks for
 * the field by its pixels, and these are at the orbit center at least as wide as fibers, a near field becomes the far
 * field that is its mean over the width (Yan et al. 2017, section 5.2, equations 26 and 27, at full coverage).
 * *far: room for the latter. */
const struct appearance *surface_field_model(const struct report *report, size_t i, const struct appearance *best,
                                             struct appearance *far);

#endif
