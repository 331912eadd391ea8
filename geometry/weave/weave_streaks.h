/* The directions of yarns from their streaks. Yarns are never equal: a thick or a dark one shows along its whole
 * length, and its streak gives the power spectrum a ray through zero, across the yarn's direction. That is visible
 * even where yarns are too narrow to be seen. */
#ifndef SELVEDGE_GEOMETRY_WEAVE_STREAKS_H
#define SELVEDGE_GEOMETRY_WEAVE_STREAKS_H

#include <stddef.h>

enum { WEAVE_RAYS = 360 };

/* ray[i]: median over the frequencies along the angle i / 2 degrees of ln(power / background), 0 where there is no ray.
 * The angle counts from x to y, down the picture. The median of all rays counts as 0. */
struct weave_streaks {
    double ray[WEAVE_RAYS];
};

/* Measures rays in a spectrum as vision_spectrum makes it. */
void weave_measure_streaks(const float *power, const float *background, size_t width, size_t height,
                           struct weave_streaks *streaks);

/* The highest ray within 1.5 degrees of the direction of frequency f, not less than 0. */
double weave_streak_along(const struct weave_streaks *streaks, const double f[2]);

#endif
