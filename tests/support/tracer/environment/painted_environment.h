/* Environments whose radiance is a function of direction, for tests of lights. */
#ifndef SELVEDGE_TESTS_PAINTED_ENVIRONMENT_H
#define SELVEDGE_TESTS_PAINTED_ENVIRONMENT_H

#include "renderer/transport/environment.h"

/* Makes an environment from the values of paint at the centres of the pixels: theta from the normal and phi from x, in
 * radians. Aborts the test when that fails. The caller frees it with environment_free. */
struct environment *painted_environment(size_t width, size_t height,
                                        void (*paint)(double theta, double phi, float rgb[3]));
/* The radiance (0.7, 1, 1.3) in all directions. */
void paint_constant(double theta, double phi, float rgb[3]);
/* A sky with a wide sun and a moon, and below the horizon a dim floor. */
void paint_sky(double theta, double phi, float rgb[3]);

#endif
