/* Path-traced estimates of mean radiance over a photograph's crop for a cloth given as a volume: estimate.h's twin,
 * with the same result, units and rules (bit-identical for any number of threads; every figure with the variance of its
 * mean). Parameters are those of the phase model, then the density multiplier d in 1/m.
 */
#ifndef SELVEDGE_RENDERER_VOLUME_ESTIMATE_H
#define SELVEDGE_RENDERER_VOLUME_ESTIMATE_H

#include "renderer/scattering/phase_model.h"
#include "renderer/transport/estimate.h"
#include "renderer/transport/volume/volume_scene.h"

struct volume_estimate_request {
    const struct volume_scene *scene;
    const struct phase_model *model;
    const double *param;     /* model->n_param, internal units */
    double multiplier_per_m; /* d > 0 */
    const struct configuration *configuration;
    size_t n_configuration;
    const size_t *n_path; /* per configuration; rounded up to whole blocks of 256; 0: skip, result n_path = 0 */
    uint64_t seed;
    uint32_t iteration, replica; /* rng.h; configuration i uses stream configuration = i */
    bool want_jacobian;
};

/* out: n_configuration estimates; jac[c * (model->n_param + 1) + p], the last by d. STATUS_INVALID (d or a parameter), STATUS_CANCELLED,
 * STATUS_NUMERIC (naming model and configuration when a
 * NaN appears). */
status volume_estimate_run(const struct volume_estimate_request *q, struct thread_pool *pool,
                           const struct progress *progress, struct estimate *out, struct error *err);
/* STATUS_INVALID, field d, for a density multiplier that is not positive or above 1e9. */
status volume_check_multiplier(double multiplier_per_m, struct error *err);

#endif
