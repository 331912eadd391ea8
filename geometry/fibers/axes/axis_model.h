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

/* What all bricks share. */
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
    /* The claims are those of these segments, in the order of the bricks', up to claim_tail: the lines where they were
     * some rounds before. NULL: those of the bricks. */
    struct segment *claiming;
    float claim_tail;
    struct claim_store *store; /* keeps the claims of the bricks, or has those of `claiming`; may be NULL */
};

/* Work of one thread. By voxels of a brick, 0 between bricks: the share of fibers, its derivatives by all radii and
 * by the blur, and the weight times the residual; the derivative by the areas of all lumens; whether any of LANES
 * voxels that follow each other has a claim. The weight is that of claimed voxels, and not 0 between bricks. */
struct axis_scratch {
    lane_row model[AXIS_N_CELL];
    float weight[AXIS_N_CELL];
    float lumen[AXIS_N_CELL];
    bool touched[AXIS_N_CELL / LANES];
    struct axis_claims claims;
};

#endif
