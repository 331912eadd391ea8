/* The contrast of a texture at three scales, and how far a rendering is from a photograph.
 *
 * Contrast at a scale: standard deviation of the band-passed picture over its local mean. The band of the scale P is
 * the difference of two Gaussians of standard deviations s and 2 s, s = P / 8: it passes 0.67 of a wave of period P,
 * and less than 0.4 of one of P / 4 or 4 P. A sinusoid of period P and relative amplitude A has the contrast
 *
 *   A / sqrt(2) (exp(-2 (pi s / P)^2) - exp(-8 (pi s / P)^2)).
 *
 * Because scales are relative to the weave's own period, pictures of different magnification compare. */
#ifndef SELVEDGE_GEOMETRY_WEAVE_CONTRAST_H
#define SELVEDGE_GEOMETRY_WEAVE_CONTRAST_H

#include "base/status.h"

enum { WEAVE_SCALES = 3 }; /* half of the period, the period, twice the period */

/* grey: height x width, linear. Where the local mean is not positive a pixel does not count. Pixels nearer than 2
 * periods to an edge do not count. STATUS_INVALID: fewer than 8 periods in the picture, or a period below 2 pixels;
 * STATUS_NO_MEMORY, STATUS_INTERNAL. */
status weave_contrast(const float *grey, size_t width, size_t height, double period_px, double contrast[WEAVE_SCALES],
                      struct error *err);

/* Computes the term that white noise of the pixels adds to the square of each contrast. relative_var: mean over the
 * pixels of the noise's variance over the square of the local mean, before the picture was smoothed by a Gaussian of
 * blur_px pixels (0: it was not). Errors as weave_contrast, for a picture of 8 periods. */
status weave_contrast_noise(double relative_var, double blur_px, double period_px, double square[WEAVE_SCALES],
                            struct error *err);

/* The figures of a picture that are compared. */
struct weave_look {
    double mean_rgb[3], contrast[WEAVE_SCALES];
};

/* Measures an rgb picture (height x width x 3, linear). Its contrast is the contrast of the mean of the channels.
 * Errors as weave_contrast. */
status weave_look_measure(const float *rgb, size_t width, size_t height, double period_px, struct weave_look *look,
                          struct error *err);

/* Root mean square over the channels of rendering / photograph - 1: a dark channel counts as much as a bright one. */
double weave_color_error(const struct weave_look *rendering, const struct weave_look *photograph);
/* Root mean square over the scales of rendering / photograph - 1. */
double weave_contrast_error(const struct weave_look *rendering, const struct weave_look *photograph);

#endif
