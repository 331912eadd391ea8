/* How well the fibers of a tile continue in its neighbours, and a mending of the ends that nearly do.
 *
 * An end (first or last vertex) within one fiber radius of a face across x or y lies on the seam. Two ends at opposite faces continue each
 * other when their lines run within 45 degrees of one direction and they are less than a reach apart in the plane of the face (periodic in
 * the other axis); every end has one partner at most, nearest pairs first.
 */
#ifndef SELVEDGE_GEOMETRY_FIBER_SEAM_H
#define SELVEDGE_GEOMETRY_FIBER_SEAM_H

#include "geometry/fibers/fiber_set.h"

struct fiber_seam {
    size_t n_end[2];       /* on both faces across x, y */
    size_t n_continued[2]; /* of them: with a partner within one radius */
    double share[2];       /* n_continued / n_end; NaN without ends */
    double offset_m[2];    /* mean distance of these partners in the plane of the face; NaN without any */
};

/* STATUS_NO_MEMORY. f must satisfy fiber_set_validate. */
status fiber_seam_measure(const struct fiber_set *f, struct fiber_seam *seam, struct error *err);

/* Partners within two radii are brought together halfway and onto the faces; the shift fades out over the next 8 radii of arc length.
 * n_joined: pairs of ends. STATUS_NO_MEMORY. */
status fiber_seam_join(struct fiber_set *f, size_t *n_joined, struct error *err);

#endif
