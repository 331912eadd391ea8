/* A smooth displacement of a whole tile that brings the yarns at opposite faces together. Half of the offset of
 * seam_field.h is applied at either face, and fades out towards the middle of the tile. */
#ifndef SELVEDGE_GEOMETRY_SEAM_WARP_H
#define SELVEDGE_GEOMETRY_SEAM_WARP_H

#include "geometry/fibers/seam/seam_ends.h"
#include "geometry/fibers/seam/seam_field.h"

struct seam_warp {
    struct seam_field field; /* no cells: nothing moves */
    int axis;                /* across this seam: 0 x, 1 y */
    double tile_m, margin_m; /* size of the tile, and depth from a face within which points move */
};

/* Estimates the warp from the ends s of the seam: their common offset, then means of the offsets of matched ends
 * under narrower and narrower Gaussians (24 to 8 radii). Nothing moves unless more ends then continue each other.
 * The partners in s are changed. STATUS_NO_MEMORY. */
status seam_warp_find(struct seam_ends *s, struct seam_warp *w, struct error *err);
void seam_warp_release(struct seam_warp *w);

/* Moves a point, m. */
void seam_warp_move(const struct seam_warp *w, double p[3]);
/* Root mean square displacement at the faces, m. */
double seam_warp_rms(const struct seam_warp *w);

#endif
