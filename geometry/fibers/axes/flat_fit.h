/* Fits whole lines with sections of two axes (fiber_section.h), and removes lines that follow a part of another fiber.
 *
 * Tracing takes fibers for round: a flat fiber gets a second line in the part that a disc does not cover, as if a thin
 * fiber lay beside a thick one. Where fibers turn out to be flat, lines that come nearer to a longer one than touching
 * fibers are suspects. The other lines are fitted once more without them: if the section of one then extends over a
 * suspect, both were the same fiber, and the suspect is removed. Otherwise it is a fiber of its own and stays, because
 * a section that covers a neighbour would also cover the void beside their contact. */
#ifndef SELVEDGE_GEOMETRY_FLAT_FIT_H
#define SELVEDGE_GEOMETRY_FLAT_FIT_H

#include "geometry/fibers/axes/axis_fit.h"
#include "geometry/fibers/axes/shape_measure.h"

/* Ratios of the axes of the fibers' sections. Discs come out as up to some 1.1, because noise is never negative. */
struct section_ratio {
    double mean, sd;  /* over the length of all lines; between lines */
    size_t n_removed; /* vertices of lines inside the sections of others */
};

struct flat_fit {
    const struct volume *v;
    double diameter_voxel;
    int n_round;
    size_t min_vertex; /* shorter pieces that a removal leaves are dropped */
    struct thread_pool *pool;
    const struct progress *progress;
    /* NULL, or the sections with their errors are left in lines->shape. Without it that has the sections of flat fibers
     * without errors, and is NULL where fibers are round. */
    struct shape_measure *measure;
    /* The volume was interpolated because its fibers are thin. The wedges of void beside the contact of two such fibers
     * are nearly lost in the blur, so lines are removed only from cloths whose fibers are clearly flat. */
    bool interpolated;
};

/* As polylines_fit, with profile->section NULL. Where radii are found to vary along lines, and after a removal, another
 * round of the fit precedes the last measurement. STATUS_CANCELLED, STATUS_NO_MEMORY. */
status polylines_fit_flat(struct polyline_set *lines, const struct flat_fit *f, struct axis_profile *profile,
                          struct section_ratio *ratio, struct error *err);

#endif
