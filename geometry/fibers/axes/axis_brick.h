/* The sums of axis_fit.h over one brick of the scan: what its voxels say about the lines near them. Lengths are in
 * voxels. */
#ifndef SELVEDGE_GEOMETRY_AXIS_BRICK_H
#define SELVEDGE_GEOMETRY_AXIS_BRICK_H

#include "base/lanes.h"
#include "geometry/fibers/axes/axis_solve.h"
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

void axis_scratch_init(struct axis_scratch *s);
void axis_scratch_release(struct axis_scratch *s);

/* For the vertices of the brick's segments, and for the profile. */
struct axis_brick_sum {
    struct axis_pull *pull;       /* two for each segment of the brick, in the order of its list */
    struct section_pull *section; /* one for each segment; NULL for discs */
    struct lumen_pull *lumen;     /* one for each segment; NULL for solid fibers */
    struct shared_sum shared;
};

/* The caller frees the arrays of the sum. Returns false when memory is out. */
bool axis_brick_fit(const struct axis_model *model, size_t i_brick, struct axis_scratch *s, struct axis_brick_sum *sum);

#endif
