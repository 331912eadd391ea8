/* What tracers have in place of recorded paths whose radiance has no derivatives, which a record would serve. */
#ifndef SELVEDGE_RENDERER_RADIANCE_UNRECORDED_H
#define SELVEDGE_RENDERER_RADIANCE_UNRECORDED_H

#include "renderer/transport/radiance_source.h"

/* The record and the replay of a radiance_tracer. */
void radiance_record_nothing(const void *state, size_t i_configuration, const double xy[2], struct rng *rng,
                             struct radiance_record *record, float *value);
double radiance_replay_nothing(const void *at, const void *traced, const struct radiance_record *record);

#endif
