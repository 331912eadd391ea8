/* Exact scattering of a plane wave by an infinite circular cylinder at oblique incidence (Bohren and Huffman 1983,
 * "Absorption and Scattering of Light by Small Particles", equations 8.22 to 8.34): the reference for
 * renderer/scattering/models/wave/solver/oblique_solver.h, with its amplitudes.
 *
 * theta is the angle of the wave vector from the plane across the cylinder (zeta = 90 degrees - theta in the book).
 * T_oi(d) is the sum of t_oi,n exp(i n d); across the fields, coefficients of n and -n have opposite signs.
 */
#ifndef SELVEDGE_TESTS_MIE_OBLIQUE_H
#define SELVEDGE_TESTS_MIE_OBLIQUE_H

#include "tests/support/wave/mie_cylinder.h"

struct mie_oblique {
    double kappa_x; /* x cos(theta) */
    size_t n_order;
    double complex along[MIE_MAX_ORDER], across[MIE_MAX_ORDER], between[MIE_MAX_ORDER]; /* b_I, a_II, a_I */
};

/* x = 2 pi radius over the wavelength. Returns 0, or -1 when x is too large. */
int mie_oblique_init(struct mie_oblique *c, double x, double complex m, double theta_rad);
/* T_oi at d from straight on. |T_oi| of both o /= i is the same. */
double complex mie_oblique_amplitude(const struct mie_oblique *c, enum mie_field o, enum mie_field i, double d);
/* Cross-sections over the diameter, per unit of light on the width: those of the book over cos(theta). */
double mie_oblique_extinction(const struct mie_oblique *c, enum mie_field i);
double mie_oblique_scattering(const struct mie_oblique *c, enum mie_field i);

/* Largest difference of these cross-sections from those of treams 0.4.7 (Beutel, Fernandez-Corbaton and Rockstuhl 2024;
 * treams.coeffs.mie_cyl). */
double mie_oblique_published_error(void);

#endif
