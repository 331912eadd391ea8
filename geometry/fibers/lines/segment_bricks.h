/* Segments of polylines sorted by the bricks of a voxel grid that they come near, and distances to the nearest
 * segment. Lengths are in voxels. Used to measure the radius, to transfer directions and to compare model and scan. */
#ifndef SELVEDGE_GEOMETRY_SEGMENT_BRICKS_H
#define SELVEDGE_GEOMETRY_SEGMENT_BRICKS_H

#include "geometry/fibers/fiber_set.h"
#include "geometry/fibers/polyline.h"

#include <stdbool.h>

struct segment {
    float a[3], b[3];
    uint32_t line;
    float radius; /* of the line, or in its middle where it varies, voxels; 0 if it is not known */
    uint8_t axis;
    bool is_first, is_last; /* first or last segment of its line */
};

struct segment_bricks {
    size_t n_voxel[3], n_brick[3];
    size_t edge; /* edge of a brick in voxels */
    float reach; /* a brick lists the segments within this distance; the largest reach if each segment has its own */
    struct segment *segment;
    size_t n_segment;
    size_t *first; /* number of bricks + 1 */
    uint32_t *index;
};

/* Make the lists from polylines in voxels, or from a fiber set in metres. After STATUS_NO_MEMORY or STATUS_TOO_LARGE
 * (2^32 segments) there is nothing to release. */
status segment_bricks_init(struct segment_bricks *s, const struct polyline_set *lines, const size_t n_voxel[3],
                           size_t edge, float reach, struct error *err);
/* The same, but a brick lists the segments within whose own reach it lies. reach: one value for each segment, in the
 * order of the lines. */
status segment_bricks_init_each(struct segment_bricks *s, const struct polyline_set *lines, const size_t n_voxel[3],
                                size_t edge, const float *reach, struct error *err);
/* Updates places and radii of the segments from the lines that the lists were made from; the lists of the bricks stay
 * as they are. *first: NULL, or the result of an earlier move; if it is NULL, it receives the original
 * segments, which the caller frees. STATUS_NO_MEMORY. */
status segment_bricks_move(struct segment_bricks *s, const struct polyline_set *lines, struct segment **first,
                           struct error *err);
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
/* The voxels of a brick (cut at the faces), and the lattice with `factor` points per voxel along each axis in it. */
void segment_brick_box(const struct segment_bricks *s, size_t i_brick, size_t from[3], size_t n[3]);
struct point_lattice segment_brick_lattice(const struct segment_bricks *s, size_t i_brick, size_t factor);
/* distance2[point]: squared distance to the nearest segment, or reach^2 if none is nearer. nearest[point]: index of the
 * segment, or UINT32_MAX. Points are in the order (z, y, x); both arrays have room for SEGMENT_SLACK more. Lines are
 * assumed to bend by less than about 10 degrees at a vertex: the first and last segment of a line are compared with all
 * points, the others only with the slab between their ends and one voxel beyond. */
enum { SEGMENT_SLACK = 8 };
void segment_distances(const struct segment_bricks *s, size_t i_brick, const struct point_lattice *lattice,
                       float *distance2, uint32_t *nearest);

#endif
