/* Gradient certificate: compares the derivatives that the tracers carry along with differences of the same paths.
 *
 * A few paths of every configuration are traced once, with derivatives, and recorded (path_tracer.h, volume_tracer.h).
 * The radiance of a recorded path at other parameters needs no tracing, so its derivative by each parameter also
 * follows from four points around the parameter (five-point stencil; beside a bound, four points on the inner side).
 * Both derivatives are of the same paths, so a difference beyond rounding is an error in the scores of the model or in
 * the sums of the tracer, for this scene and these parameters.
 *
 * For parameter p, J_i and D_i being the mean derivatives of configuration i summed over channels, w_i its weight:
 *     error = sum_i w_i |J_i - D_i| / max(sum_i w_i |J_i|, 0.001 sum_i w_i R_i / |p|)
 * The second term bounds the error of a parameter that hardly acts. The standard error follows from the scatter of the
 * differences of single paths. All random numbers come from the key, so results are the same bits every time.
 */
#ifndef SELVEDGE_RENDERER_DERIVATIVE_CHECK_H
#define SELVEDGE_RENDERER_DERIVATIVE_CHECK_H

#include "renderer/transport/radiance_source.h"

struct derivative_check_request {
    struct radiance_input input; /* parameters inside the model's bounds; want_derivative is taken as true */
    const bool *skip;            /* parameters of all sets that are not looked at; NULL: none */
    const struct configuration *configuration;
    const double *weight; /* of each configuration, > 0; NULL: all 1 */
    size_t n_configuration;
    size_t n_path; /* of all configurations together, at least one each; long paths stop earlier */
    uint64_t seed;
    uint32_t iteration, replica;
};

struct derivative_check {
    size_t n_param;                                                   /* of all sets together */
    double error[SCATTERING_MAX_FLAT], error_se[SCATTERING_MAX_FLAT]; /* 0 for skipped ones */
    bool checked[SCATTERING_MAX_FLAT];
    size_t worst;            /* parameter with the largest error */
    uint64_t n_path, n_step; /* paths, and their scattering events */
};

/* STATUS_INVALID as for an estimate; STATUS_CANCELLED; STATUS_NUMERIC (naming model and parameter) for a value that is
 * not finite. */
status derivative_check_run(const struct derivative_check_request *q, const struct progress *progress,
                            struct derivative_check *out, struct error *err);

#endif
