/* Rays through a single fiber with a cuticle, a cortex and a medulla, in three dimensions: what a goniometer would
 * measure of it. It shares no formula with fur.v1, which has lobes and a table where this has paths.
 *
 * The fiber is a cylinder of radius 1. Its wall is rough and its scales are tilted: where a ray meets it, the normal is
 * turned along the fiber by a tilt of alpha / 2 with a standard deviation of beta / 2, and around it by gamma / 2, so
 * that mirrored light has the shift alpha and the widths beta and gamma. The wall reflects by Fresnel's law in the
 * section of the ray, through `layers` layers of cuticle (Yan et al. 2015, equations 1 and 2), and refracts what it
 * does not reflect. The cortex absorbs; the medulla, a cylinder of radius kappa in it, absorbs and scatters by the
 * phase function of Henyey and Greenstein. Coefficients are by the radius of the fiber. A ray ends where it is absorbed
 * or leaves, after any number of reflections.
 */
#ifndef SELVEDGE_TESTS_FIBER_RAYS_H
#define SELVEDGE_TESTS_FIBER_RAYS_H

#include "optimizer/photographs/profile/fiber_profile.h"

#include <stdint.h>
#include <stdio.h>

struct ray_fiber {
    double eta, kappa, layers, alpha_rad, beta_rad, gamma_rad, sigma_ms, sigma_ma, g, sigma_ca;
    bool either_way; /* half of the rays meet a fiber whose scales are tilted the other way */
};

enum { PUBLISHED_N_FIBER = 10 };
/* The fibers of table 4 of Yan, Jensen and Ramamoorthi 2017, and their names. */
struct ray_fiber published_fiber(int i);
extern const char *const published_fiber_name[PUBLISHED_N_FIBER];

/* Follows n_ray rays of light from theta_i and counts them in the bins of the goniometer of Yan et al. 2015: theta_o 10
 * to 50 degrees in steps of 2, phi -20 to 200 in steps of 5. A bin has the standard error of a count, and an empty one
 * that of one ray. Returns the share of the rays that leave the fiber. The caller releases the profile. */
double fiber_rays_profile(const struct ray_fiber *fiber, double theta_i_rad, uint32_t n_ray, uint64_t seed,
                          struct fiber_profile *profile);
/* The same as a table of a job, without the column theta_i_deg. */
void fiber_rays_print(const struct fiber_profile *profile, FILE *out);

#endif
