/* A second path tracer that the renderer must agree with. It is deliberately slow and simple: it uses double precision,
 * tests every segment, has no next-event estimation and no roulette, draws directions independently of the model, and
 * finds the lamp by chance. It supports two_lobe.v1 in one channel with the black sheet below,
 * with light that leaves a fiber where it is hit or across its width (scattering_model.across_width).
 */
#ifndef SELVEDGE_TESTS_NAIVE_TRACER_H
#define SELVEDGE_TESTS_NAIVE_TRACER_H

#include "base/rng.h"
#include "geometry/fibers/fiber_set.h"
#include "renderer/scene/configuration.h"

#include <stdbool.h>

/* Radiance of one path through a random point of the crop (channel 0 of the parameters). */
double naive_path(const struct fiber_set *f, const struct configuration *c, const double param[9], bool across_width,
                  struct rng *r);
/* Radiance that arrives from the square lamp of the configuration along direction d. from_m is the receiving point
 * relative to the orbit centre, in metres in the cloth frame. Returns 0 when the direction misses the lamp. */
double naive_lamp_radiance(const struct configuration *c, const double from_m[3], const double d[3]);

#endif
