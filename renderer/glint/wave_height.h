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
    /* NULL until wave_height_curve: second derivatives, 1 / um; the variance of the term of the third order at normal
     * deviates of a place with a standard deviation of 1 um, 1 / um^4 */
    float *curve_uu, *curve_uv, *curve_vv, *third2;
};

/* A tile of 1024 texels of 1 um with bumps of 0.35 um at a correlation length of 8 um, without scratches. */
struct wave_height_option wave_height_option_usual(void);
/* STATUS_INVALID names the value that is out of range; STATUS_NO_MEMORY. */
status wave_height_init(struct wave_height *h, const struct wave_height_option *o, struct error *err);
void wave_height_release(struct wave_height *h);

/* Fills in the derivatives of the second and third order, as differences of the slopes. STATUS_NO_MEMORY. */
status wave_height_curve(struct wave_height *h, struct error *err);
/* Mean variance of the phase that a kernel of the standard deviation sigma_um leaves out, the term of the third order
 * of 2 pi xi_3 H / lambda, in radians^2 at 0.5 um and xi_3 = 2. After wave_height_curve. */
double wave_height_rest(const struct wave_height *h, double sigma_um);

#endif
