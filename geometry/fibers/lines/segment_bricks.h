/* Segments of polylines filed by the bricks of a voxel grid that they come near, and distances to the nearest of them.
 * Lengths in voxels. Used for radius determination, direction transfer and the comparison of model and scan. */
#ifndef SELVEDGE_GEOMETRY_SEGMENT_BRICKS_H
#define SELVEDGE_GEOMETRY_SEGMENT_BRICKS_H

#include "geometry/fibers/fiber_set.h"
#include "geometry/fibers/lines/polyline.h"

#include <stdbool.h>

struct segment {
    float a[3], b[3];
    uint32_t line;
    uint8_t axis;
    bool is_first, is_last; /* of its line */
};

struct segment_bricks {
    size_t n_voxel[3], n_brick[3];
    size_t edge; /* voxels */
    float reach; /* a brick's list has every segment within this distance of the brick */
    struct segment *segment;
    size_t n_segment;
    size_t *first; /* bricks + 1 */
    uint32_t *index;
};

/* From polylines in voxels, or from a fiber set in metres. Nothing to release after STATUS_NO_MEMORY, STATUS_TOO_LARGE (2^32 segments). */
status segment_bricks_init(struct segment_bricks *s, const struct polyline_set *lines, const size_t n_voxel[3],
                           size_t edge, float reach, struct error *err);
status segment_bricks_from_fibers(struct segment_bricks *s, const struct fiber_set *f, const size_t n_voxel[3],
                                  const double voxel_size_m[3], size_t edge, float reach, struct error *err);
void segment_bricks_release(struct segment_bricks *s);

/* A lattice of points: origin + spacing * (i + 1/2), n points along each axis. */
struct point_lattice {
    float origin[3], spacing;
    size_t n[3];
};

static inline size_t segment_n_brick(const struct segment_bricks *s)
{
    return s->n_brick[0] * s->n_brick[1] * s->n_brick[2];
}
/* Voxels of a brick (cut at the faces) and the lattice with `factor` points a voxel and axis in it. */
void segment_brick_box(const struct segment_bricks *s, size_t i_brick, size_t from[3], size_t n[3]);
struct point_lattice segment_brick_lattice(const struct segment_bricks *s, size_t i_brick, size_t factor);
/* distance2[point]: squared distance to the nearest segment, reach^2 where none is nearer; nearest[point] (may be NULL): its
 * index, UINT32_MAX where none. Points in the order (z, y, x). Lines are taken to bend by less than some 10 degrees a vertex: a segment
 * is looked at from the slab between its ends and a voxel beyond, only the last ones of a line from all around. */
void segment_distances(const struct segment_bricks *s, size_t i_brick, const struct point_lattice *lattice,
                       float *distance2, uint32_t *nearest);

#endif
