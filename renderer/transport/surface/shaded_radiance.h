/* Shared by the radiance sources of fibers whose own function gives the radiance along each camera ray, in place of
 * whole paths: by tables, by dual scattering, by diffusion. They have no derivatives, and no records of paths. */
#ifndef SELVEDGE_RENDERER_SHADED_RADIANCE_H
#define SELVEDGE_RENDERER_SHADED_RADIANCE_H

#include "renderer/transport/radiance_tracer.h"
#include "renderer/transport/surface/path_tracer.h"

/* One way to shade. A setting holds its values for one configuration: a struct that begins with a path_setting. */
struct shaded_method {
    const char *name; /* as in "cannot render by <name>" */
    size_t setting_bytes;
    /* Checks further requirements of the method. The input has already been checked for a scattering model without its
     * own frame, no derivatives, no discrepancy and no speckle. */
    status (*check)(const struct radiance_input *in, struct error *err);
    /* Fills in the rest of a setting, which is all 0 after its path_setting. STATUS_NO_MEMORY. */
    status (*init)(void *setting, const struct radiance_input *in, struct error *err);
    /* Releases a setting whose init was called, even if init failed. NULL: there is nothing to release. */
    void (*release)(void *setting);
    /* Adds the radiance along a ray of camera_ray to `radiance`. Changes the ray. Returns the number of bounces. */
    uint32_t (*shade)(const void *setting, struct scene_ray *ray, struct rng *rng, float radiance[3]);
};

/* The functions of a radiance_tracer, whose prepare calls this one with its method. max_member and entry_bytes of the
 * tracer are 1. */
status shaded_prepare(const struct shaded_method *m, const struct radiance_input *in, const struct configuration *c,
                      size_t n_configuration, void **state, struct error *err);
void shaded_release(void *state);
uint64_t shaded_trace(const void *state, const struct radiance_block *b, float *value);
void shaded_record_nothing(const void *state, size_t i_configuration, const double xy[2], struct rng *rng,
                           struct radiance_record *record, float *value);
double shaded_replay_nothing(const void *at, const void *traced, const struct radiance_record *record);

/* A radiance_tracer with this prepare. */
#define SHADED_TRACER(prepare_method)                                                                                  \
    {                                                                                                                  \
        .max_path = RADIANCE_BLOCK_PATHS, .max_member = 1, .entry_bytes = 1, .prepare = prepare_method,                \
        .release = shaded_release, .trace = shaded_trace, .record = shaded_record_nothing,                             \
        .replay = shaded_replay_nothing                                                                                \
    }

#endif
