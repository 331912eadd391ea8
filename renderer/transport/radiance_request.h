/* Requests for estimates (renderer/estimate/estimate.h) and pictures (renderer/estimate/render.h) of a cloth. */
#ifndef SELVEDGE_RENDERER_RADIANCE_REQUEST_H
#define SELVEDGE_RENDERER_RADIANCE_REQUEST_H

#include "renderer/transport/radiance_tracer.h"

struct estimate_request {
    struct radiance_input input;
    const struct configuration *configuration;
    size_t n_configuration;
    const size_t *n_path; /* per configuration; rounded up as estimate_n_path says; 0: skip, result n_path = 0 */
    uint64_t seed;
    uint32_t iteration, replica; /* rng.h; configuration i uses stream configuration = i */
    bool next_replica_too;       /* estimates replica + 1 as well, from the same shared tasks: n_configuration more
                                    estimates in out. Not for means over rotations */
    bool share_camera_paths;     /* configurations that differ in their lamp only are estimated from the same paths (as
                                    many as the one that asks for most): 1.4 to 1.9 times the paths in the same time for
                                    two lamps. The errors of such configurations go together (estimate.partner). Volumes
                                    trace separate paths all the same. */
};

struct render_request {
    struct radiance_input input;
    const struct configuration *configuration;
    size_t width, height, n_sample; /* samples a pixel */
    size_t first_sample;            /* their first number: pictures of other numbers have other random numbers */
    uint64_t seed;
    uint32_t stream; /* takes the place of the configuration number in the random key; at most 4095 */
};

#endif
