/* Environments painted by a function of direction, for the tests of lights. */
#ifndef SELVEDGE_TESTS_PAINTED_ENVIRONMENT_H
#define SELVEDGE_TESTS_PAINTED_ENVIRONMENT_H

#include "renderer/transport/light/environment.h"

/* theta from the normal, phi from x, in rad, at the middle of each pixel. Aborts the test when it cannot be made; free with
 * environment_free. */
struct environment *painted_environment(size_t width, size_t height,
                                        void (*paint)(double theta, double phi, float rgb[3]));
/* (0.7, 1, 1.3) everywhere. */
void paint_constant(double theta, double phi, float rgb[3]);
/* A wide sun and a moon in a sky, nothing below the horizon but a dim floor. */
void paint_sky(double theta, double phi, float rgb[3]);

#endif
