/* Scattering of a plane wave by a fiber of any smooth outline, the wave vector across its axis: a boundary-element
 * solver of Helmholtz' equation in the plane of the section, for a material that may absorb.
 *
 * Waves go with exp(-i omega t). The field u is along the axis (E of TM) or across it (H of TE); its wave number is k
 * outside and k m inside. On the outline u and v = du/dn, the derivative outside, satisfy Mueller's equations
 *
 *     u + (D_i - D_e) u + (S_e - q S_i) v = u_in
 *     (1 + q) / 2 v + (D'_e - q D'_i) v - (T_e - T_i) u = du_in / dn          q = 1 (TM) or m^2 (TE)
 *
 * with the operators of the single layer S, the double layer D, its transpose D', and the derivative T of the double
 * layer, in each medium. The strongest singularities of T cancel, so all kernels are smooth but for a logarithm, and
 * the equations have one solution at every frequency. They are solved at equidistant t by Nystroem's method with the
 * quadrature of Kussmaul and Martensen, which converges faster than any power of the number of nodes. Kress 2014,
 * "Linear Integral Equations", sections 12.3 and 13; Mueller 1969, "Foundations of the Mathematical Theory of
 * Electromagnetic Waves". It takes the place of the elements of Xia et al. 2020, "A Wave Optics Based Fiber Scattering
 * Model", which are of first order.
 *
 * Far away u = u_in - sqrt(2 / (pi k r)) exp(i (k r - pi / 4)) T, and cross-sections, per length of the fiber, are
 *
 *     extinction = 4 / k Re T(straight on)     scattering = 2 / (pi k) integral of |T|^2     absorption by the flux
 *                                                                                            of u and v
 */
#ifndef SELVEDGE_RENDERER_WAVE_SOLVER_H
#define SELVEDGE_RENDERER_WAVE_SOLVER_H

#include "renderer/scattering/models/wave/solver/wave_outline.h"

enum wave_field { WAVE_ALONG, WAVE_ACROSS, WAVE_N_FIELD }; /* TM, TE */

struct wave_problem {
    const struct wave_outline *outline;
    double k;             /* radians per unit of length outside */
    double complex index; /* of the fiber over index of the medium; the imaginary part absorbs and is at least 0 */
    enum wave_field field;
    size_t n_node; /* even */
};

/* Returns the number of nodes that puts at least `per_wave` nodes on each wavelength inside. With 4, errors of smooth
 * outlines are below 1e-10 of the forward amplitude, with 3 below 1e-3. */
size_t wave_solver_nodes(const struct wave_outline *o, double k, double index, double per_wave);

struct wave_solver;
/* Sets up the equations and factorises them by LAPACK, which takes n_node^3 and holds 64 n_node^2 bytes. STATUS_INVALID
 * with the field "index", "k", "n_node"; STATUS_NO_MEMORY. */
status wave_solver_new(const struct wave_problem *problem, struct wave_solver **s, struct error *err);
void wave_solver_free(struct wave_solver *s);

/* Solves for waves that travel towards each of n angles from the x axis. STATUS_NO_MEMORY. */
status wave_solver_solve(struct wave_solver *s, const double *angle_rad, size_t n, struct error *err);
/* Three ways to get amplitudes T: of all n waves towards one angle from the x axis; of one wave towards n_angle
 * equidistant angles, the first of which is 0; of one wave towards one angle. */
void wave_solver_towards(const struct wave_solver *s, double angle_rad, double complex *t);
void wave_solver_amplitudes(const struct wave_solver *s, size_t i_wave, double complex *t, size_t n_angle);
double complex wave_solver_amplitude(const struct wave_solver *s, size_t i_wave, double angle_rad);

double wave_solver_extinction(const struct wave_solver *s, size_t i_wave);
/* Returns the scattering cross-section from amplitudes towards n equidistant angles. Exact for n above 2 k times the
 * largest distance within the outline. */
double wave_scattering_of(double k, const double complex *t, size_t n);
double wave_solver_absorption(const struct wave_solver *s, size_t i_wave);

#endif
