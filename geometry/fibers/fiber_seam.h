/* Measures how well the fibers of a tile continue in the neighbouring tiles, and joins ends that nearly do.
 *
 * An end (first or last vertex) lies on the seam if it is within one fiber radius of a face across x or y. Two ends
 * at opposite faces continue each other if their directions differ by less than 45 degrees and their distance in the
 * plane of the face, which is periodic in the other axis, is less than a given reach. Every end has at most one
 * partner; the nearest pairs are matched first. */
#ifndef SELVEDGE_GEOMETRY_FIBER_SEAM_H
#define SELVEDGE_GEOMETRY_FIBER_SEAM_H

#include "geometry/fibers/fiber_set.h"

struct fiber_seam {
    size_t n_end[2];       /* on both faces across x, y */
    size_t n_continued[2]; /* ends with a partner within one radius */
    double share[2];       /* n_continued / n_end; NaN if there are no ends */
    double offset_m[2];    /* mean distance of these partners in the plane of the face; NaN if there are none */
};

/* f must satisfy fiber_set_validate. STATUS_NO_MEMORY. */
status fiber_seam_measure(const struct fiber_set *f, struct fiber_seam *seam, struct error *err);

/* Moves partners within two radii to their midpoint and onto the faces. The shift fades out over the next 8 radii of
 * arc length. *n_joined: number of pairs. STATUS_NO_MEMORY. */
status fiber_seam_join(struct fiber_set *f, size_t *n_joined, struct error *err);

#endif
