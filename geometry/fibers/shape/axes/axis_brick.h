/* The sums of axis_fit.h over one brick of the scan: what its voxels say about the lines near them. Lengths are in
 * voxels. */
#ifndef SELVEDGE_GEOMETRY_AXIS_BRICK_H
#define SELVEDGE_GEOMETRY_AXIS_BRICK_H

#include "geometry/fibers/lines/segment_bricks.h"
#include "geometry/fibers/shape/axes/axis_profile.h"
#include "geometry/fibers/shape/axes/axis_solve.h"
#include "geometry/fibers/shape/axes/fiber_section.h"
#include "geometry/volume/volume.h"

#include <stdbool.h>

enum { AXIS_BRICK = 32, AXIS_N_CELL = AXIS_BRICK * AXIS_BRICK * AXIS_BRICK };

/* What all bricks share. */
struct axis_model {
    const struct volume *v;
    const struct segment_bricks *bricks; /* with edge AXIS_BRICK */
    const struct section_view *section;  /* of each segment; NULL: discs */
    struct axis_profile profile;
    struct axis_table table;
    float tail, inverse_blur; /* tail: voxels beyond the radius up to which a fiber is modelled */
};

/* A voxel near a line, and the segment of the line that is nearest to it. */
struct axis_claim {
    uint32_t cell, segment;
    float distance2;
};

/* Work of one thread. Between bricks model, by_radius and by_blur are 0, and own is UINT32_MAX. */
struct axis_scratch {
    float model[AXIS_N_CELL], by_radius[AXIS_N_CELL], by_blur[AXIS_N_CELL], own2[AXIS_N_CELL];
    uint32_t own[AXIS_N_CELL], touched[AXIS_N_CELL];
    struct axis_claim *claim;    /* of all lines of the brick, in their order */
    struct section_place *place; /* of each claim, where sections are not discs */
    size_t n_claim, capacity, place_capacity;
};

void axis_scratch_init(struct axis_scratch *s);
void axis_scratch_release(struct axis_scratch *s);

/* For the vertices of the brick's segments, and for the profile. */
struct axis_brick_sum {
    struct axis_pull *pull;       /* two for each segment of the brick, in the order of its list */
    struct section_pull *section; /* one for each segment; NULL for discs */
    struct shared_sum shared;
};

/* The caller frees the arrays of the sum. Returns false when memory is out. */
bool axis_brick_fit(const struct axis_model *model, size_t i_brick, struct axis_scratch *s, struct axis_brick_sum *sum);

#endif
