#include "renderer/transport/radiance_unrecorded.h"

void radiance_record_nothing(const void *state, size_t i_configuration, const double xy[2], struct rng *rng,
                             struct radiance_record *record, float *value)
{
    (void)state, (void)i_configuration, (void)xy, (void)rng, (void)value;
    record->n_entry = record->n_bounce = 0;
}

double radiance_replay_nothing(const void *at, const void *traced, const struct radiance_record *record)
{
    (void)at, (void)traced, (void)record;
    return 0.0;
}
