/* A second path tracer, deliberately naive: double precision, every segment tested, no next-event estimation, no
 * roulette, directions drawn without looking at the model, lamp found by chance. Slow and simple: what the renderer
 * must agree with. Only two_lobe.v1, one channel, black sheet below.
 */
#ifndef SELVEDGE_TESTS_NAIVE_TRACER_H
#define SELVEDGE_TESTS_NAIVE_TRACER_H

#include "base/rng.h"
#include "geometry/fibers/fiber_set.h"
#include "renderer/scene/configuration.h"

/* Radiance of one path through a random point of the crop (channel 0 of the parameters). */
double naive_path(const struct fiber_set *f, const struct configuration *c, const double param[9], struct rng *r);
/* Radiance of the configuration's square lamp that comes from direction d to a point seen from the orbit centre (m, cloth
 * frame); 0 beside the lamp. */
double naive_lamp_radiance(const struct configuration *c, const double from_m[3], const double d[3]);

#endif
