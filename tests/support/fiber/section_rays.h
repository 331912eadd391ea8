/* Light of a turned elliptical fiber by rays in space (space_ray.h), as the device of the fabric thesis shows it over
 * (phi_i, phi_o) (section 4.7.3): simulated fibers for tables 4.2 and 4.3. It shares with elliptical_oriented.v1 the
 * definition of the lobes alone: both azimuths of exit p are blurred by sqrt((p + 1) / 2) gamma, and along the fiber
 * the exits have the tilted lobes that elliptical.h states. */
#ifndef SELVEDGE_TESTS_SECTION_RAYS_H
#define SELVEDGE_TESTS_SECTION_RAYS_H

#include "optimizer/photographs/profile/fiber_profile.h"

#include <stdint.h>

struct section_fiber {
    double ratio, eta, c_t; /* c_t: share of the light that a diameter of the round fiber of equal area lets through */
    double alpha_rad, beta_rad, gamma_rad;
    double turn_rad; /* phi_i of light along the short axis */
};

enum { SECTION_ALL_MODES = -1 };

/* Adds to the radiance of every row what rays of mode p (0: R, 1: TT ...) or of all exits carry to it, per irradiance
 * across the light's direction. Rows with the same theta_i and phi_i stand together. n_ray: of each exit and phi_i, a
 * lattice, so that there is no noise of counting. */
void section_rays_add(const struct section_fiber *fiber, int mode, uint32_t n_ray, struct fiber_profile *profile);

/* The (phi_i, phi_o) plots of tables 4.2 and 4.3: theta_i 0, -30 and -60 degrees, theta_o = -theta_i, n_phi_i azimuths
 * of the light around the fiber from the turn, views 5 degrees apart. The rows are dark; the caller releases the
 * profile. */
void section_rays_rows(size_t n_phi_i, double turn_rad, struct fiber_profile *profile);

/* Adds noise of 3 % of each radiance and of 1 % of the brightest, and states it as errors. */
void section_rays_noise(struct fiber_profile *profile, uint64_t seed);

#endif
