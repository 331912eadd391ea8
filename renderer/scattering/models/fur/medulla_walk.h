/* Random walk of light in the medulla of a fiber, in two dimensions: in a circle of radius 1 for the azimuth of exit,
 * and in a slab of thickness 2 for the angle along the fiber (Yan, Jensen and Ramamoorthi 2017, section 4.3; Yan 2018,
 * appendix C). Free flights are exponential, turns follow the planar function of Henyey and Greenstein,
 *
 *     rho(t) = (1 - g^2) / (2 pi (1 + g^2 - 2 g cos t))
 *
 * and nothing is absorbed or reflected at the boundary. The first collision is forced and stratified over the way
 * through, so that all walks are scattered. Lengths are in radii of the medulla; `depth` is the scattering coefficient
 * times that radius. Walks are a function of the state of `rng` alone.
 */
#ifndef SELVEDGE_RENDERER_MEDULLA_WALK_H
#define SELVEDGE_RENDERER_MEDULLA_WALK_H

#include "base/rng.h"

struct medulla_medium {
    double depth, g; /* depth > 0; 0 <= g < 1 */
};

/* Light that comes from azimuth 0 travels along -x and enters at y = -offset, |offset| < 1. Adds to turn[n_turn] how
 * many of n_walk walks leave in directions whose azimuth is nearest to 2 pi j / n_turn. */
void medulla_walk_round(const struct medulla_medium *m, double offset, int n_walk, struct rng *r, int n_turn,
                        double *turn);

/* Light from the angle theta_i. Adds to half[0] and half[1], each of n_theta bins over [-pi/2, pi/2], how many walks
 * leave on the side of entry and on the other one. The angle of exit is measured as theta_i is, so light that goes
 * straight on has -theta_i. */
void medulla_walk_slab(const struct medulla_medium *m, double theta_i, int n_walk, struct rng *r, int n_theta,
                       double *half[2]);

#endif
