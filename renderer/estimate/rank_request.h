/* How the requests of the root of a team look as bytes. After this head come the parameter values, the discrepancy
 * if there is one, the configurations (whose environment is a mark: NULL or not), and the numbers of paths of an
 * estimate. */
#ifndef SELVEDGE_RENDERER_RANK_REQUEST_H
#define SELVEDGE_RENDERER_RANK_REQUEST_H

#include "renderer/estimate/shared_cloth.h"

enum { RANK_MODEL_BYTES = 64 };

struct rank_request {
    struct shared_numbers numbers;
    char model[RANK_MODEL_BYTES];
    uint64_t n_set, n_configuration, seed;
    uint64_t width, height, n_sample, first_sample; /* of a picture */
    uint32_t stream, iteration, replica;
    uint8_t want_derivative, plain_paths, share_camera_paths, next_replica_too, has_discrepancy;
};

/* Values in radiance_input.param. */
static inline size_t rank_request_n_param(const struct radiance_input *in)
{
    return (in->n_set > 1 ? in->n_set : 1) * in->model->n_param;
}

#endif
