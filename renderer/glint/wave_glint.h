/* Glints by wave optics: the reflectance of a small place of a metal surface whose height field is known to a
 * micrometre (fur and glints thesis, sections 2.3, 3.11 and 3.12, appendix B).
 *
 * Light is coherent within a window w(s) = exp(-|s - x_c|^2 / (2 sd^2)) that ends at 3 sd. The phase of the reflected
 * light is a sum of Gabor kernels, one for each texel, whose Fourier transform is known (equation 3.37):
 *
 *     f_r = xi_1 / A_c |sum over k of w_k xi_2 l^2 exp(-i 2 pi (xi_3 H_k + psi . m_k) / lambda)
 *                       exp(-2 pi^2 sigma^2 |xi_3 H'_k + psi|^2 / lambda^2)|^2,
 *     sigma = l / 2,   A_c = pi sd^2 (1 - exp(-9))
 *
 * xi: wave_diffraction.h. Differs: kernels follow the curvature of the surface, with another last factor, and l is 1, 2
 * or 4 texels (wave-glints.md). Kernels are found by the hierarchy of wave_tree.h. Kernels beyond 3 standard deviations
 * of the direction at the longest wavelength are dropped, as published; at shorter wavelengths more are kept than
 * needed.
 *
 * Frame: u, v on the surface in um, z its normal; wi and wo are unit vectors away from it. The tile repeats. f_r is per
 * steradian and 0 when a direction is below the surface. Nothing here shadows or reflects twice, so f_r belongs to
 * slopes that are small. Immutable; threads share it. */
#ifndef SELVEDGE_RENDERER_WAVE_GLINT_H
#define SELVEDGE_RENDERER_WAVE_GLINT_H

#include "renderer/glint/metal_index.h"
#include "renderer/glint/wave_diffraction.h"
#include "renderer/glint/wave_height.h"

/* Middles of eight bins of 0.36 to 0.83 um. */
enum { WAVE_N_COLOR = 8 };

struct wave_glint;

struct wave_glint_option {
    struct wave_height_option height;
    double coherence_um;   /* sd of the window: 2 texels to 20 texels, and 10 um as published */
    enum wave_model model; /* r_ghs is the usual one */
    bool is_published;     /* flat kernels, one for each texel, for comparison */
};

struct wave_glint_option wave_glint_option_usual(void);
/* STATUS_INVALID names the value that is out of range; STATUS_NO_MEMORY. */
status wave_glint_new(const struct wave_glint_option *o, struct wave_glint **out, struct error *err);
void wave_glint_free(struct wave_glint *g);
/* Side of the tile. */
double wave_glint_side_um(const struct wave_glint *g);

struct wave_glint_query {
    double center_um[2]; /* x_c */
    float wi[3], wo[3];
};

/* f_r without the metal's reflectance (F = 1) at n wavelengths, in one pass over the hierarchy. is_pruned = false keeps
 * all kernels of the window, for comparison. Returns the number of kernels that were summed, in multiples of LANES. */
size_t wave_glint_value(const struct wave_glint *g, const struct wave_glint_query *q, const float *wavelength_um,
                        size_t n, bool is_pruned, float *f);
/* f_r in linear sRGB under D65 from eight wavelengths. metal: METAL_N stands for a perfect mirror. A channel can be
 * below 0, where a color is outside of sRGB. */
void wave_glint_rgb(const struct wave_glint *g, const struct wave_glint_query *q, enum metal metal, float rgb[3]);

/* Draws wo for wi with the density wave_glint_pdf: the slope of a place in the window, drawn by w^2, is blurred by a
 * Gaussian as wide as diffraction, or in a sixth of the samples as a kernel. u: four numbers in [0, 1), and u[4] that
 * chooses the width. Returns false when the direction is below the surface, which stands for f_r = 0.
 * Differs from section 3.12: the density is by intensities, and the weight f_r cos_o / pdf is not taken as 1. */
bool wave_glint_sample(const struct wave_glint *g, const double center_um[2], const float wi[3], const float u[5],
                       float wo[3]);
/* Density per steradian of wo, of the query's wi. Its integral is the share of samples above the surface. */
float wave_glint_pdf(const struct wave_glint *g, const struct wave_glint_query *q);

/* The wavelengths, and the weight of each in linear sRGB. The weights of a channel have the sum 1. */
void wave_glint_colors(float wavelength_um[WAVE_N_COLOR], float weight_rgb[WAVE_N_COLOR][3]);

#endif
