/* Scattering of a plane wave by a fiber of any smooth outline, the wave vector at any angle to its axis: Maxwell's
 * equations in the plane of the section, for a material that may absorb. At theta = 0 it repeats wave_solver.h.
 *
 * theta is the angle of the wave vector from the plane across the fiber. All fields go with exp(i k_z z), k_z =
 * k sin(theta). Those along the axis, u = E_z and w = H_z (times the impedance of the medium), satisfy Helmholtz'
 * equation with the wave numbers kappa_e = k cos(theta) outside and kappa_i = k sqrt(m^2 - sin^2(theta)) inside. u, w
 * and the components along the outline are continuous, which couples both fields (d/ds along the outline, v = du/dn,
 * y = dw/dn outside):
 *
 *     v_i = q_E v - c / m^2 dw/ds     q_E = kappa_i^2 / (kappa_e m)^2     c = sin(theta) (1 - kappa_i^2 / kappa_e^2)
 *     y_i = q_H y + c du/ds           q_H = kappa_i^2 / kappa_e^2
 *
 * Mueller's equations of wave_solver.h, with S_e - q S_i and so on, get the terms of g = v_i - q v:
 *
 *     u + (D_i - D_e) u + (S_e - q S_i) v - S_i g = u_in
 *     (1 + q) / 2 v + (D'_e - q D'_i) v - (T_e - T_i) u + (1 / 2 - D'_i) g = du_in / dn
 *
 * and likewise for w. d/ds is the derivative of the trigonometric polynomial through the nodes. A mirror of an outline
 * that is symmetric about the x axis, with nodes at +-t, keeps E_z even and H_z odd, or the reverse: two systems of
 * half the size take the place of one.
 *
 * Amplitudes T_oi of the field o from an incident wave of the field i, both over the axial component of the incident
 * wave, and cross-sections are defined as in wave_solver.h, with kappa_e in place of k: 2 / (pi kappa_e) times
 * |T_oi|^2 is power over that which falls on a unit of width.
 */
#ifndef SELVEDGE_RENDERER_OBLIQUE_SOLVER_H
#define SELVEDGE_RENDERER_OBLIQUE_SOLVER_H

#include "renderer/scattering/models/wave/solver/wave_solver.h"

#include <stdbool.h>

struct oblique_problem {
    const struct wave_outline *outline;
    double k;             /* radians per unit of length outside */
    double complex index; /* as of wave_problem */
    double theta_rad;     /* |theta| < pi / 2 */
    size_t n_node;        /* even */
};

struct oblique_solver;
/* Sets up the equations and factorises them by LAPACK: 5 n_node^3 multiplications for symmetric outlines, 21 n_node^3
 * for others. Errors of wave_solver_new, and STATUS_INVALID with the field "theta". */
status oblique_solver_new(const struct oblique_problem *problem, struct oblique_solver **s, struct error *err);
void oblique_solver_free(struct oblique_solver *s);
/* Whether the solver uses a mirror of the outline. */
bool oblique_solver_is_symmetric(const struct oblique_solver *s);

/* Solves for n waves of either field, that travel towards these angles from the x axis in the plane. STATUS_NO_MEMORY.
 */
status oblique_solver_solve(struct oblique_solver *s, const double *angle_rad, size_t n, struct error *err);
/* Amplitudes towards one angle: T_oi of wave w at t[(o WAVE_N_FIELD + i) n + w]. */
void oblique_solver_towards(const struct oblique_solver *s, double angle_rad, double complex *t);

/* Cross-sections of wave w with the incident field i. */
double oblique_solver_extinction(const struct oblique_solver *s, enum wave_field i, size_t w);
double oblique_solver_absorption(const struct oblique_solver *s, enum wave_field i, size_t w);

#endif
