/* elliptical.v1: a rough dielectric fiber with an elliptical section, seen from afar and turned at random about its
 * axis. Reciprocal; lossless from both sides where C_T = 1.
 *
 *     S = a(th_i) a(th_o) sum over R, TT, TRT, TRRT and the rest of M_p(th_i, th_o) N_p(th_d, ph)
 *     N_p = mean over the azimuths of the section, weighted by the width that it shows, and over that width, of
 *           A_p D(ph - Phi_p; sqrt(p + 1) gamma);   N_rest = the mean of A_rest, over 2 pi
 *     M_p = (g(th_o + th_i - alpha_p; beta_p) + g(th_o + th_i + alpha_p; beta_p)) / 2
 *     alpha_p / alpha = 1, -1/2, -3/2, -5/2,   beta_p / beta = 1, 1/2, 2, 2
 *
 * Fabric thesis, section 4.4 and appendix A; Khungurn and Marschner 2017, "Azimuthal Scattering from Elliptical Hair
 * Fibers". ellipse_ray.h defines shares A, azimuths Phi and ways inside; the rest are the exits beyond TRRT. g is a
 * Gaussian. Absorption takes C_T^l, l in units of 2 sqrt(A B), the diameter of a round fiber of the same section.
 *
 * Differs from the publication: the section's orientation is averaged over, because cloth is made of twisted yarns and
 * scans hardly resolve it; light beyond TRRT is kept; the shift by scales is taken in both directions alike, since a
 * fiber in a cloth has no known root; and a(th), which balances the lobes as in dielectric.v1, takes the place of the
 * normaliser G, so that S is reciprocal and nothing is lost at grazing angles.
 *
 * The means are taken over a lattice of N_RAY rays, at N_ROW + 1 values of cos th_d, as Fourier series in ph
 * (a wrapped Gaussian is a factor exp(-k^2 w^2 / 2)), and read between N_PHI + 1 azimuths by straight lines.
 * Derivatives are exact for the tabulated function.
 */
#ifndef SELVEDGE_RENDERER_ELLIPTICAL_H
#define SELVEDGE_RENDERER_ELLIPTICAL_H

#include "renderer/scattering/models/elliptical/elliptical_lobes.h"

enum {
    ELLIPTICAL_N_PHI = 180,
    ELLIPTICAL_N_RAY = 1499,
    ELLIPTICAL_RAY_STEP = 565 /* of the lattice: N_RAY over it is near the square of the golden ratio */
};

/* By cos th_d. */
struct elliptical_row {
    float rest[3], d_rest[ELLIPTICAL_D_RATIO + 1][3];       /* A_rest / (2 pi); by C_T of the channel, eta, ratio */
    float energy[ELLIPTICAL_N_MODE][3];                     /* mean A of each mode: for the choice of a mode */
    float density[ELLIPTICAL_N_LOBE][ELLIPTICAL_N_PHI + 1]; /* of azimuths, integral 1 over [0, pi] */
    float below[ELLIPTICAL_N_LOBE][ELLIPTICAL_N_PHI + 1];   /* its integral from 0 */
};

struct scattering_state {
    struct tilted_lobe along[ELLIPTICAL_N_LOBE];
    struct elliptical_scale scale;
    struct elliptical_row row[ELLIPTICAL_N_ROW + 1];
    struct elliptical_cell cell[ELLIPTICAL_N_ROW + 1][ELLIPTICAL_N_PHI + 1];
    struct elliptical_slope slope[ELLIPTICAL_N_ROW + 1][ELLIPTICAL_N_PHI + 1];
};

/* Fills in rows, cells and slopes, and the energies. STATUS_NO_MEMORY. */
status elliptical_tables(struct scattering_state *s, const double *param, struct elliptical_energies *energies,
                         struct error *err);

#endif
