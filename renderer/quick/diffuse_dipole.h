/* The dipole: light that diffuses under the flat surface of a deep medium (Jensen, Marschner, Levoy and Hanrahan 2001,
 * "A Practical Model for Subsurface Light Transport"; dissertation of Yan, equation 2.4), for a medium whose surface
 * neither reflects nor refracts, like the surface of a pile: A = 1, so the virtual source is 7/3 as high as the real
 * one is deep.
 *
 * Closed forms, with s = sigma_tr z_r = sqrt(3 (1 - albedo)):
 *     integral of R_d over the plane:  albedo / 2 (exp(-s) + exp(-7/3 s))
 *     mean square of r, weighted by R_d:  2 z_r^2 (exp(-s) + 7/3 exp(-7/3 s)) / (s (exp(-s) + exp(-7/3 s)))
 * Printed: sigma_tr = sqrt(3) sigma_a sigma'_t. The root is of the product: sigma_tr = sqrt(3 sigma_a sigma'_t).
 */
#ifndef SELVEDGE_RENDERER_DIFFUSE_DIPOLE_H
#define SELVEDGE_RENDERER_DIFFUSE_DIPOLE_H

struct diffuse_dipole {
    double albedo;       /* reduced albedo: sigma'_s / sigma'_t */
    double depth_mm;     /* z_r = 1 / sigma'_t, the depth of the real source */
    double decay_per_mm; /* sigma_tr */
};

/* Coefficients of absorption and of (reduced) scattering, the latter above 0. */
struct diffuse_dipole diffuse_dipole_of(double absorption_per_mm, double scattering_per_mm);
/* The medium of a given reflectance, in [0, 1), and mean square distance between where light enters and leaves. */
struct diffuse_dipole diffuse_dipole_match(double reflectance, double mean_square_mm2);

/* R_d: exitance at the distance r from where a unit of power enters, per mm^2. */
double diffuse_dipole_at(const struct diffuse_dipole *d, double r_mm);
/* The integral of R_d over the plane. */
double diffuse_dipole_reflectance(const struct diffuse_dipole *d);
double diffuse_dipole_mean_square_mm2(const struct diffuse_dipole *d);
/* A distance of density 2 pi r R_d / reflectance, by u in [0, 1). */
double diffuse_dipole_sample(const struct diffuse_dipole *d, double u_source, double u_distance);

#endif
