/* The model of a scan by fibers near given lines (axis_fit.h), and the arrays of one thread for a brick of it.
 * Lengths are in voxels. */
#ifndef SELVEDGE_GEOMETRY_AXIS_MODEL_H
#define SELVEDGE_GEOMETRY_AXIS_MODEL_H

#include "base/lanes.h"
#include "geometry/fibers/axes/model/axis_lumen.h"
#include "geometry/fibers/axes/model/axis_profile.h"
#include "geometry/fibers/axes/model/fiber_section.h"
#include "geometry/fibers/axes/model/nearest_cache.h"
#include "geometry/fibers/axes/model/nearest_segment.h"
#include "geometry/volume/volume.h"

#include <stdbool.h>

/* The data that all bricks share. */
struct axis_model {
    const struct volume *v;
    size_t first_row;                    /* of the whole volume that v begins with; 0 but in ranks with a slab of it */
    const struct segment_bricks *bricks; /* with edge AXIS_BRICK */
    const struct section_view *section;  /* of each segment; NULL: discs */
    const struct lumen_view *lumen;      /* of each segment, with sections; NULL: solid fibers */
    const struct lumen_table *lumen_table;
    struct axis_profile profile;
    struct axis_table table;
    float tail, inverse_blur; /* tail: voxels beyond the radius up to which a fiber is modelled */
    /* Segments of the lines where they were some rounds before, in the order of the bricks': voxels up to nearest_tail
     * belong to the nearest of these. NULL: to the nearest of the bricks' own. */
    struct segment *nearest_of;
    float nearest_tail;
    struct nearest_cache
        *store; /* keeps the nearest segments of bricks, or has the lists of `nearest_of`; may be NULL */
};

/* Work of one thread. By voxels of a brick, 0 between bricks: the share of fibers, its derivatives by all radii and
 * by the blur, and the weight times the residual; the derivative by the areas of all lumens; whether any of LANES
 * voxels that follow each other has a nearest segment. The weight is valid for such voxels only, and not 0 between
 * bricks. */
struct axis_scratch {
    lane_row model[AXIS_N_CELL];
    float weight[AXIS_N_CELL];
    float lumen[AXIS_N_CELL];
    bool touched[AXIS_N_CELL / LANES];
    struct nearest_segments nearest;
};

#endif
