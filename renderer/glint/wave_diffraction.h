/* The five scalar diffraction models of a reflecting height field, as values of one option (fur and glints thesis,
 * figure 2.5). Each one is
 *
 *     f_r = xi_1 / A_c |integral of w(s - x_c) R(s) exp(-i 2 pi psi . s / lambda) ds|^2,   psi = wi + wo on the surface
 *     R(s) = xi_2 exp(-i 2 pi xi_3 H(s) / lambda)
 *
 *     model      xi_1 lambda^2 / F            xi_2                      xi_3
 *     ohs        cos_o / cos_i                1                         2
 *     ghs        cos_o / cos_i                1                         psi . n
 *     r_ohs      (psi . n)^2 / (4 cos_i cos_o)  1                       2
 *     r_ghs      (psi . n)^2 / (4 cos_i cos_o)  1                       psi . n
 *     kirchhoff  (psi . n)^2 / (4 cos_i cos_o)  1 - psi . H' / (psi . n)  psi . n
 *
 * The last three are reciprocal. F is the reflectance of the metal (metal_index.h), which is not part of these. */
#ifndef SELVEDGE_RENDERER_WAVE_DIFFRACTION_H
#define SELVEDGE_RENDERER_WAVE_DIFFRACTION_H

#include <stdbool.h>

enum wave_model { WAVE_OHS, WAVE_GHS, WAVE_R_OHS, WAVE_R_GHS, WAVE_KIRCHHOFF, WAVE_N_MODEL };

/* "ohs", "ghs", "r_ohs", "r_ghs", "kirchhoff" */
const char *wave_model_name(enum wave_model model);
/* Returns whether there is such a model. */
bool wave_model_find(const char *name, enum wave_model *model);
bool wave_model_is_reciprocal(enum wave_model model);

/* Factors of a pair of directions. */
struct wave_factors {
    float psi[3], xi_1; /* xi_1: times lambda^2 / F */
    float xi_3;
    float per_psi_n; /* xi_2 = 1 - (psi . H') per_psi_n */
};
/* wi, wo: unit vectors in the frame of the surface, z is its normal. Returns false when one of them is not above it. */
bool wave_factors_of(enum wave_model model, const float wi[3], const float wo[3], struct wave_factors *f);

#endif
