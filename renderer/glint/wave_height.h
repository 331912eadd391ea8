/* A periodic height field of a surface, the input of wave optics (wave_glint.h): heights and slopes of texels of about
 * a micrometre. It is a sum of smooth noise and of scratches, whose slopes are exact derivatives of its heights.
 *
 * Noise: white noise on the texels, filtered by a Gaussian of the standard deviations length_um / 2. Its
 * autocorrelation is rms_um^2 exp(-(x / length_u)^2 - (y / length_v)^2), so a correlation length is the distance at
 * which the correlation is 1 / e, and the slope along u has the root mean square sqrt(2) rms_um / length_u. Equal
 * lengths give bumps, unequal ones a brushed surface.
 * Scratches: grooves with a Gaussian cross-section at random places and in random directions. Depths and widths are
 * between half and one and a half of the stated ones, lengths between a quarter and half of the tile.
 * Source: height fields of the fur and glints thesis, section 3.12. Differs: filtered noise in place of an inverse FFT,
 * which gives the same Gaussian random field. */
#ifndef SELVEDGE_RENDERER_WAVE_HEIGHT_H
#define SELVEDGE_RENDERER_WAVE_HEIGHT_H

#include "base/status.h"

#include <stddef.h>
#include <stdint.h>

struct wave_height_option {
    size_t n;            /* texels along each side of the tile, a power of two of 64 to 4096 */
    double texel_um;     /* 0.25 to 4 */
    double rms_um;       /* of the noise; 0: none. At most 10 */
    double length_um[2]; /* correlation lengths along u and v, of at least 3 texels and at most the tile */
    size_t n_scratch;    /* in a tile */
    double scratch_depth_um, scratch_width_um; /* width: standard deviation of the cross-section, at least 1.5 texels */
    uint64_t seed;
};

/* Rows of n texels, v is the row. */
struct wave_height {
    size_t n;
    float texel_um;
    float *height_um, *slope_u, *slope_v; /* slopes: derivative of the height along u and v, dimensionless */
    float *gain;                          /* 0 until wave_height_straighten */
};

/* A tile of 1024 texels of 1 um with bumps of 0.35 um at a correlation length of 8 um, without scratches. */
struct wave_height_option wave_height_option_usual(void);
/* STATUS_INVALID names the value that is out of range; STATUS_NO_MEMORY. */
status wave_height_init(struct wave_height *h, const struct wave_height_option *o, struct error *err);
void wave_height_release(struct wave_height *h);

/* Corrects kernels of the standard deviation sigma_um for the curvature of the surface, which is not part of the
 * publication. A flat kernel stands for a phase whose curvatures are x_j / sigma^2, x_j = 2 pi xi_3 sigma^2 kappa_j /
 * lambda. Neighbouring kernels are not in phase, and their sum is the field over the product of (1 + i x_j)^(1/2). Each
 * kernel is therefore multiplied by this product. To the second order in x its argument is a change of height,
 * sigma^2 (kappa_1 + kappa_2) / 2, and the logarithm of its size is 2 pi^2 sigma^2 / lambda^2 times xi_3^2 gain,
 * gain = sigma^2 (kappa_1^2 + kappa_2^2) / 2, so both serve every wavelength. Beyond that order both are exact at
 * 0.5 um for xi_3 = 2. Changes the heights and fills in gain. STATUS_NO_MEMORY. */
status wave_height_straighten(struct wave_height *h, double sigma_um, struct error *err);
/* Root mean square of x_j for 0.5 um and xi_3 = 2. */
double wave_height_bend(const struct wave_height *h, double sigma_um);

#endif
