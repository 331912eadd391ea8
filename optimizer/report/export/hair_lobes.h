/* The hair model that Mitsuba 3 ("hair"), pbrt-v4 ("hair") and Blender (Principled Hair BSDF) share, without tilted
 * scales: Chiang, Bitterli, Tappan, Burley 2016, "A Practical and Controllable Hair and Fur Model for Production Path
 * Tracing", sections 3 and 4, as in the source of pbrt. Here it is a mean over the offset h across the fiber.
 *
 * Angles as in renderer/scattering/scattering.h: th from the normal plane, ph about the fiber. Functions return the
 * density of the light that leaves into wi, for light from wo: with S of scattering.h it is S cos(th_i). Dimensionless
 * over steradians; its integral over all wi is the share of the light that is not absorbed. */
#ifndef SELVEDGE_OPTIMIZER_HAIR_LOBES_H
#define SELVEDGE_OPTIMIZER_HAIR_LOBES_H

#include <stddef.h>

struct hair_lobes {
    double longitudinal_roughness, azimuthal_roughness; /* beta_m, beta_n in (0, 1] */
    double index;                                       /* of refraction, above 1 */
    double absorption[3];                               /* sigma_a, by radii of the fiber */
};

enum { HAIR_LOBES_MAX_PHI = 32 };

/* n_theta angles th_i, and n_phi <= HAIR_LOBES_MAX_PHI relative azimuths ph_i - ph_o. */
struct hair_directions {
    const double *theta_i_rad, *phi_rad;
    size_t n_theta, n_phi;
};

/* Adds the density for a part of the light from th_o, in [0, 1], to out[n_theta][n_phi][3]. */
void hair_lobes_density(const struct hair_lobes *h, double part_of_light, double theta_o_rad,
                        const struct hair_directions *to, double *out);

#endif
