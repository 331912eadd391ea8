/* The matrix that brings weft to x and warp to y, from the main directions of a cloth. */
#ifndef SELVEDGE_GEOMETRY_ALIGNMENT_H
#define SELVEDGE_GEOMETRY_ALIGNMENT_H

#include "geometry/orientation/main_directions.h"

enum align_outcome {
    ALIGN_DONE,
    ALIGN_NO_DIRECTION, /* felt or noise: there is no main direction */
    /* A direction leans more than 45 degrees out of the plane of x and y, or weft or warp is missing and fibers run
     * along z. */
    ALIGN_OTHER_AXES
};

struct alignment {
    enum align_outcome outcome;
    double matrix[9];    /* identity unless ALIGN_DONE; row-major, as the option OPTION_MATRIX */
    double rotation_deg; /* of weft, or of the only system, within the plane, from x towards y, before alignment */
    double shear_deg;    /* angle between warp and weft minus 90 degrees */
    double tilt_deg;     /* of the plane of warp and weft, or of the only system, against x and y */
    double se_deg, tilt_se_deg; /* the larger standard error of the two directions */
};

/* Computes the matrix. A direction without a repeat (repeat_directions_refine) counts as lying in the plane of x and
 * y. Two systems: weft to x, warp to y, and their common normal to z, with lengths along all three kept. One system:
 * the rotation by the shortest way to the nearer of x and y. */
void alignment_from_directions(const struct main_directions *m, struct alignment *a);

#endif
