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
 * The second term bounds the error of a parameter that hardly acts.
 *
 * A sum of absolute values is not 0 without a fault. The noise of J_i - D_i has the standard deviation s_i, estimated
 * from the scatter of single paths, and the mean of a normal deviate's absolute value is sqrt(2 / pi) of its standard
 * deviation. A fault scatters as well, as the derivatives of the paths do: the share of them that all paths together
 * miss by is taken off first. Noise alone therefore gives the error
 *     noise = sqrt(2 / pi) sum_i w_i s_i / the same scale, c4(n) s_i being what n paths show of s_i on average,
 * and the standard deviation of error - noise, noise_se, has the variance
 *     (1 - 4 / pi + 2 / (pi c4(n)^2)) sum_i w_i^2 s_i^2 / scale^2.
 * Two paths give the same distribution for error and noise however the differences are distributed.
 * All random numbers come from the key, so results are the same bits every time.
 */
#ifndef SELVEDGE_RENDERER_DERIVATIVE_CHECK_H
#define SELVEDGE_RENDERER_DERIVATIVE_CHECK_H

#include "renderer/estimate/radiance_source.h"

struct derivative_check_request {
    struct radiance_input input; /* parameters inside the model's bounds; want_derivative is taken as true */
    const bool *skip;            /* parameters of all sets that are not looked at; NULL: none */
    const struct configuration *configuration;
    const double *weight; /* of each configuration, > 0; NULL: all 1 */
    size_t n_configuration;
    size_t n_path; /* of all configurations together, at least two each; long paths stop earlier */
    uint64_t seed;
    uint32_t iteration, replica;
};

struct derivative_check {
    size_t n_param; /* of all sets together */
    /* 0 for skipped ones; noise and noise_se: mean and standard deviation of the error from noise alone */
    double error[SCATTERING_MAX_FLAT], noise[SCATTERING_MAX_FLAT], noise_se[SCATTERING_MAX_FLAT];
    bool checked[SCATTERING_MAX_FLAT];
    size_t worst;            /* parameter with the largest excess */
    uint64_t n_path, n_step; /* paths, and their scattering events */
};

/* Returns the error of parameter p less 3 standard deviations of its noise; may be negative. */
double derivative_check_excess(const struct derivative_check *check, size_t p);

/* STATUS_INVALID as for an estimate; STATUS_CANCELLED; STATUS_NUMERIC (naming model and parameter) for a value that is
 * not finite. */
status derivative_check_run(const struct derivative_check_request *q, const struct progress *progress,
                            struct derivative_check *out, struct error *err);

#endif
