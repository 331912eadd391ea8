/* One segment of a fiber in double precision: the convex hull of the two balls at its ends, whose radii may differ. Any
 * unit of length.
 */
#ifndef SELVEDGE_TESTS_CAPSULE_H
#define SELVEDGE_TESTS_CAPSULE_H

#include <stdbool.h>

struct capsule {
    double a[3], b[3], radius[2]; /* the balls: set by the caller */
    double axis[3], length;       /* unit vector from a to b, and their distance */
    double sine, cosine;          /* of the half angle by which the side narrows from a to b */
    bool is_ball;                 /* one ball contains the other */
};

/* Fills in what follows from the balls. */
void capsule_finish(struct capsule *c);
/* The part t[0] .. t[1] of the line o + t d inside; d has length 1. False: the line misses. */
bool capsule_interval(const struct capsule *c, const double o[3], const double d[3], double t[2]);
/* Signed distance of a point from the surface, negative inside. normal: of the nearest point of the surface, outwards.
 * radius: of the ball along the axis that touches the surface there. */
double capsule_distance(const struct capsule *c, const double x[3], double normal[3], double *radius);

#endif
