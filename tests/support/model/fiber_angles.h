/* Directions in the frame of a fiber from their angles. */
#ifndef SELVEDGE_TESTS_FIBER_ANGLES_H
#define SELVEDGE_TESTS_FIBER_ANGLES_H

#include <math.h>

/* theta from the plane across the fiber and phi around it, rad. */
static inline void direction(double theta, double phi, float w[3])
{
    w[0] = (float)sin(theta);
    w[1] = (float)(cos(theta) * cos(phi));
    w[2] = (float)(cos(theta) * sin(phi));
}

#endif
