/* The planes in which fiber centers are searched for: perpendicular to the three axes as in the paper, and in
 * addition to the six diagonals between two axes, so that every fiber crosses some plane at less than 36 degrees
 * from its normal.
 *
 * Lengths are in voxels. The centre of pixel (i, j) of slice k is origin + (i + 1/2) u + (j + 1/2) v + (k + 1/2) w. */
#ifndef SELVEDGE_GEOMETRY_SLICE_FRAME_H
#define SELVEDGE_GEOMETRY_SLICE_FRAME_H

#include <stddef.h>

enum { N_SLICE_FRAME = 9 };

struct slice_frame {
    int index; /* 0..2: perpendicular to x, y, z; 3..8: perpendicular to the diagonals */
    float origin[3], u[3], v[3], w[3];
    size_t width, height, n_slice;
};

/* Computes the normal of a frame, a unit vector. */
void slice_frame_normal(int index, float w[3]);
/* Makes the frame that covers a volume of n voxels. */
void slice_frame_init(struct slice_frame *f, int index, const size_t n[3]);

static inline void slice_frame_point(const struct slice_frame *f, float iu, float iv, float iw, float x[3])
{
    for (int a = 0; a < 3; a++) x[a] = f->origin[a] + iu * f->u[a] + iv * f->v[a] + iw * f->w[a];
}

/* In-plane axes of slices perpendicular to a coordinate axis: the other two, in ascending order. */
static inline int slice_axis_u(int axis) { return axis == 0 ? 1 : 0; }
static inline int slice_axis_v(int axis) { return axis == 2 ? 1 : 2; }

#endif
