/* Conversion between degrees and radians. Degrees occur only in files, JSON and tables of constants; everything else is
 * in radians. */
#ifndef SELVEDGE_BASE_ANGLE_H
#define SELVEDGE_BASE_ANGLE_H

#include <math.h>

/* Factors, usable in constant initialisers: radians of one degree, and degrees of one radian. */
#define RAD_PER_DEG (M_PI / 180.0)
#define DEG_PER_RAD (180.0 / M_PI)

/* The angle in degrees. Multiplies before it divides, so it can differ from angle_rad * DEG_PER_RAD by one rounding. */
static inline double angle_to_deg(double angle_rad) { return angle_rad * 180.0 / M_PI; }

#endif
