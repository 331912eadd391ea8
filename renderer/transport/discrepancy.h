/* The part of a measured fabric that fibers do not explain: a smooth factor on the radiance of the cloth, close to 1,
 * that depends on the directions of light and camera to the cloth's normal alone. A fit finds it from the ratios of
 * measured to rendered radiances (optimizer/fit/baseline); renderings of the same cloth are multiplied by it.
 *
 *   ln factor_c = sum_k weight_kc exp(-1/2 sum_a ((x_a - place_ka) / scale_a)^2),  at most DISCREPANCY_MOST in size,
 *
 * x: angle of the half vector to the normal; angle of light and camera to the half vector; sum of the squares of the
 * angles of light and camera to the normal; the larger of these two. All of them stay the same when light and camera
 * are exchanged, so the factor keeps the cloth reciprocal. Far from all places it is 1. Light that comes from or goes
 * to the back of the cloth has the factor 1.
 *
 * Source: the model discrepancy of Kennedy and O'Hagan 2001, "Bayesian calibration of computer models", in these
 * coordinates (the first two as in Rusinkiewicz 1998, "A new change of variables for efficient BRDF
 * representation"). Angles are in radians. Plain memory; immutable while it is used.
 */
#ifndef SELVEDGE_RENDERER_DISCREPANCY_H
#define SELVEDGE_RENDERER_DISCREPANCY_H

#include <stddef.h>

enum { DISCREPANCY_MAX_PLACE = 128, DISCREPANCY_COORDINATES = 4 };
#define DISCREPANCY_MOST 0.7

struct discrepancy {
    size_t n; /* places; 0: the factor is 1 everywhere */
    double scale[DISCREPANCY_COORDINATES];
    double place[DISCREPANCY_MAX_PLACE][DISCREPANCY_COORDINATES];
    double weight[DISCREPANCY_MAX_PLACE][3];
};

/* Coordinates of a pair of directions, from the cosines of light and camera to the normal, both above 0, and the cosine
 * of the angle between light and camera. */
void discrepancy_coordinates(double cos_light, double cos_camera, double cos_between,
                             double x[DISCREPANCY_COORDINATES]);
/* exp(-1/2 d^2) of two places. */
double discrepancy_kernel(const double scale[DISCREPANCY_COORDINATES], const double x[DISCREPANCY_COORDINATES],
                          const double y[DISCREPANCY_COORDINATES]);
/* The factor for the same cosines, of any sign. */
void discrepancy_factor(const struct discrepancy *d, double cos_light, double cos_camera, double cos_between,
                        double factor_rgb[3]);

#endif
