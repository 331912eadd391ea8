/* The C interface to OpenCV for a picture's texture: even illumination and the power spectrum. Pictures are
 * single-channel floats, row-major, without padding. All exceptions are caught inside. OpenCV's own threads are off
 * after vision_init (vision.h); afterwards the functions may be called from several threads at once. */
#ifndef SELVEDGE_GEOMETRY_VISION_TEXTURE_H
#define SELVEDGE_GEOMETRY_VISION_TEXTURE_H

#ifdef __cplusplus
extern "C" {
#endif

#include "base/status.h"

/* Subtracts the local mean and divides by the local standard deviation, both under a Gaussian of sigma_px pixels, and
 * clamps to [-3, 3]. Gradients of the light go, and a dark object counts no more than any other place of its size.
 * Where the picture is constant the result is 0. flat: height x width like grey. sigma_px: 0.5 to 1000. STATUS_INVALID,
 * STATUS_NO_MEMORY, STATUS_INTERNAL (with OpenCV's message). */
status vision_flatten(const float *grey, size_t width, size_t height, double sigma_px, float *flat, struct error *err);

/* Smooths a picture by a Gaussian of sigma_px pixels; the picture is mirrored at its borders. Errors as above. */
status vision_smooth(const float *grey, size_t width, size_t height, double sigma_px, float *smooth, struct error *err);

/* Power spectrum under a Hann window, with the frequency zero in the middle: the bin (x, y) has the frequency
 * (x - width / 2) / width, (y - height / 2) / height cycles per pixel (integer division). power is smoothed by a
 * Gaussian of one bin; background is the geometric mean of power around each bin (a box of one twelfth of the
 * spectrum), which single peaks hardly raise. Both are height x width. The power of white noise of variance 1 is 1.
 * Errors as above. */
status vision_spectrum(const float *flat, size_t width, size_t height, float *power, float *background,
                       struct error *err);

#ifdef __cplusplus
}
#endif
#endif
