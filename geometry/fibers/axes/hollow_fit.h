/* Fits traced fibers with lumens to a scan whose lumens were not filled: axes, radii, sections and the lumen of each
 * fiber together (axis_lumen.h, shape_measure.h). */
#ifndef SELVEDGE_GEOMETRY_HOLLOW_FIT_H
#define SELVEDGE_GEOMETRY_HOLLOW_FIT_H

#include "geometry/fibers/axes/axis_fit.h"
#include "geometry/fibers/axes/shape_measure.h"

struct hollow_fit {
    const struct volume *v;
    double diameter_voxel;
    struct thread_pool *pool;
    const struct progress *progress;
};

/* lines: with sections, which are refined, and get lumens. *profile is the start without sections, and is refined.
 * STATUS_CANCELLED, STATUS_NO_MEMORY. */
status polylines_fit_hollow(struct polyline_set *lines, const struct hollow_fit *f, struct axis_profile *profile,
                            struct shape_measure *measure, struct error *err);

#endif
