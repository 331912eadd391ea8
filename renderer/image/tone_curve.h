/* From linear radiance to the bytes of a picture for the eye: exposure, a tone curve, and sRGB with dither.
 *
 * The curve is Khronos PBR Neutral (Khronos Group 2024): colors up to 0.8 stay as they are, less the 4 % that a glossy
 * surface reflects in front of them; above, the largest channel is compressed below 1, and the color moves to white
 * only as far as it was compressed, so that highlights keep their hue.
 */
#ifndef SELVEDGE_RENDERER_TONE_CURVE_H
#define SELVEDGE_RENDERER_TONE_CURVE_H

#include "renderer/image/image.h"

/* rgb: exposed linear Rec. 709, not below 0; then in [0, 1]. */
void tone_curve_apply(double rgb[3]);
/* 3 bytes a pixel of the first three channels * exposure. Each byte is rounded up or down with a probability that keeps
 * the mean, by a number that depends on the pixel's place alone, so that smooth shades show no steps. */
void tone_curve_bytes(const struct image *im, double exposure, uint8_t *rgb);

#endif
