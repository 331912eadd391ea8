/* Mode R of elliptical_oriented.v1 in closed form. A ray that is reflected at the normal psi leaves Delta / 2 beyond
 * it, so light that comes evenly from all azimuths and meets the width of the section evenly has the density
 *
 *     F_R(psi, Delta) = rho(psi) / (mean rho) * cos(Delta / 2) / 4 * R(cos th_d cos(Delta / 2))
 *     rho = (a cos^2 psi + sin^2 psi / a)^(-3/2), radius of curvature where the normal is psi from the long axis
 *
 * R is the reflectance by the cosine of the angle outside. Both factors are even; rho has period pi and the other one
 * 2 pi, so each is a series of cosines, which is blurred by factors. Rays in their place (2,584 for the plane) leave
 * 1 % of noise in R and more in its derivative by the ratio, which then states too small an error of the ratio. */
#ifndef SELVEDGE_RENDERER_ORIENTED_REFLECTION_H
#define SELVEDGE_RENDERER_ORIENTED_REFLECTION_H

#include "renderer/scattering/models/elliptical/elliptical_oriented.h"

/* A function or the mean of it times cos(k x), k = 0 .. ORIENTED_N, and the derivative of it by a parameter. */
enum { REFLECTION_VALUE, REFLECTION_SLOPE, REFLECTION_N_PART };
typedef double reflection_wave[REFLECTION_N_PART][ORIENTED_N + 1];

/* Means of rho / (mean rho) times cos(2 k psi); slope: by the ratio. */
void oriented_reflection_psi(double ratio, reflection_wave wave);
/* Integrals over Delta from -pi to pi of the other factor times cos(k Delta); slope: by eta. cos_theta > 0, of th_d. */
void oriented_reflection_delta(double eta, double cos_theta, reflection_wave wave);

#endif
