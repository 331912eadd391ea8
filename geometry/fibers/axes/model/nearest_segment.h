/* The voxels of a brick of the scan that lie near its lines, sorted by the segment that is nearest to them. Lengths are
 * in voxels. */
#ifndef SELVEDGE_GEOMETRY_NEAREST_SEGMENT_H
#define SELVEDGE_GEOMETRY_NEAREST_SEGMENT_H

#include "base/lanes.h"
#include "geometry/fibers/axes/model/fiber_section.h"
#include "geometry/fibers/lines/segment_bricks.h"

#include <stdbool.h>

enum { AXIS_BRICK = 32, AXIS_N_CELL = AXIS_BRICK * AXIS_BRICK * AXIS_BRICK };

/* Nearest segments: every line assigns each voxel up to `tail` beyond the outlines of its segments to the
 * nearest of them. Voxels whose nearest point is an end of the line have none. A voxel may have a nearest segment of
 * each of several lines. */
struct nearest_segments {
    /* (k AXIS_BRICK + j) AXIS_BRICK + i of each voxel with a nearest segment; the voxels of a segment follow each
     * other. LANES zeros at the end. */
    uint16_t *cell;
    uint32_t *first; /* index in `cell` of the first voxel of each segment of the brick's list, and the number of all */
    size_t capacity, first_capacity;
    /* Work for one line, with axes in an order of its own: squared distance of the nearest segment, infinite between
     * lines, and the segment's number in the brick's list, -1 between lines and beyond an end of the line. */
    float own2[AXIS_N_CELL + LANES];
    int32_t own[AXIS_N_CELL + LANES];
    /* The rows that the line has reached, and the range of voxels in each row of the brick. Between lines every end is
     * 0. */
    uint16_t row[AXIS_BRICK * AXIS_BRICK];
    uint8_t row_begin[AXIS_BRICK * AXIS_BRICK], row_end[AXIS_BRICK * AXIS_BRICK];
    size_t n_row;
};

void nearest_segments_init(struct nearest_segments *c);
void nearest_segments_release(struct nearest_segments *c);

/* Finds the nearest segments in brick i_brick of bricks with edge AXIS_BRICK. section: of each segment; NULL: discs.
 * Returns false when memory is out. */
bool nearest_segments_find(struct nearest_segments *c, const struct segment_bricks *bricks,
                           const struct section_view *section, float tail, size_t i_brick);

#endif
