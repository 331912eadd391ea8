/* Gaussian times polynomial, in closed form (fabric thesis, Lemma 4.1), and the normaliser of a longitudinal lobe made
 * of it. Double precision; pure functions. Angles in radians.
 */
#ifndef SELVEDGE_RENDERER_GAUSS_POLYNOMIAL_H
#define SELVEDGE_RENDERER_GAUSS_POLYNOMIAL_H

#include <stddef.h>

enum { GAUSS_POLYNOMIAL_MAX_DEGREE = 12 };

/* Integral over [a, b] of (p[0] + ... + p[k] x^k) g(x; m, s) dx, g the normal density, 2 <= k <=
 * GAUSS_POLYNOMIAL_MAX_DEGREE. */
double gauss_polynomial_integral(const double *p, size_t k, double m, double s, double a, double b);

/* Q of section 4.4.1: an even polynomial just above cos^2 on [-pi/2, pi/2]. */
double lobe_q(double theta_rad);

/* G(m, s) = integral over [-pi/2, pi/2] of g(t; m, s) Q(t) dt, and its derivatives (NULL when not wanted). */
double lobe_normaliser(double m_rad, double s_rad, double *d_m, double *d_s);

#endif
