/* Measures how well the fibers of a tile continue in the neighbouring tiles, and joins ends across its seams, so that
 * the repeated tile shows none. The fabric thesis (5.7.1) makes Wang tiles of the volume instead, whose cuts go where
 * scans agree best; here fibers that were cut at one face go on in the fibers cut at the other.
 *
 * seam_ends.h defines which ends lie on a seam. */
#ifndef SELVEDGE_GEOMETRY_FIBER_SEAM_H
#define SELVEDGE_GEOMETRY_FIBER_SEAM_H

#include "geometry/fibers/fiber_set.h"

struct fiber_seam {
    size_t n_end[2];       /* on both faces across x, y */
    size_t n_continued[2]; /* ends with a partner within one radius and 45 degrees */
    double share[2];       /* n_continued / n_end; NaN if there are no ends */
    double offset_m[2];    /* mean distance of these partners in the plane of the face; NaN if there are none */
    double angle_rad[2];   /* mean angle between them */
    /* Step of the section that fibers fill, in fields of two mean diameters, from a plane a quarter of a diameter
     * before the seam to one behind it: sum of the absolute differences over the sum of both, 0 .. 1. step_inside: the
     * mean of the same at eight planes within the tile, as the seam of an endless cloth would have it. NaN if no fiber
     * crosses the planes. */
    double step[2], step_inside[2];
};

/* f must satisfy fiber_set_validate. STATUS_NO_MEMORY. */
status fiber_seam_measure(const struct fiber_set *f, struct fiber_seam *seam, struct error *err);

struct seam_join {
    size_t n_joined;   /* pairs of ends */
    double warp_m[2];  /* root mean square displacement at the faces across x, y by the smooth warp of the tile */
    double shift_m[2]; /* mean distance that an end was moved in addition; NaN without pairs */
};

/* Joins the ends at the seams in two steps. A smooth warp of the tile (seam_warp.h) brings yarns together that
 * meet beside each other. Then ends are matched by the assignment of least cost within six radii, and both ends of
 * a pair are moved to their midpoint on the face and turned to their mean direction. These moves fade out along
 * the fiber, over eight radii or eight times the move, whichever is longer, but at most half of its length. Ends
 * without a partner stay as they are. f must satisfy fiber_set_validate. STATUS_NO_MEMORY. */
status fiber_seam_join(struct fiber_set *f, struct seam_join *join, struct error *err);

#endif
