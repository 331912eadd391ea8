/* Path-traced estimates of mean radiance over a photograph's crop, with derivatives by every scattering parameter from
 * the same paths (fabric thesis 5.5.1, figure 5.3). Every figure carries the variance of its mean. Results depend on
 * the key and the counts only: bit-identical for any number of threads.
 */
#ifndef SELVEDGE_RENDERER_ESTIMATE_H
#define SELVEDGE_RENDERER_ESTIMATE_H

#include "base/progress.h"
#include "base/thread_pool.h"
#include "renderer/scattering/scattering.h"
#include "renderer/scene/configuration.h"
#include "renderer/scene/scene.h"

#include <stdint.h>

struct estimate_request {
    const struct scene *scene;
    const struct scattering_model *model;
    const double *param; /* model->n_param for each set, internal units */
    const struct configuration *configuration;
    size_t n_configuration;
    const size_t *n_path; /* per configuration; rounded up to whole blocks of 256; 0: skip, result n_path = 0 */
    uint64_t seed;
    uint32_t iteration, replica; /* rng.h; configuration i uses stream configuration = i */
    bool want_jacobian;
    size_t n_set;   /* parameter sets for the scene's material groups; 0 and 1: one set for all fibers */
    bool no_probes; /* plain paths without probes towards the lamp (path_tracer.h): same means, more variance */
    bool share_camera_paths; /* configurations that differ in their lamp only are estimated from the same paths
                                (as many as the one that asks for most): 1.4 to 1.9 times the paths in the same time
                                for two lamps, but the errors of such configurations go together. Off for fits,
                                whose noise model takes them as independent. */
};

/* rgb means in radiance units; for a configuration with contrast_cells its contrast and the derivatives of that. */
struct estimate {
    double mean[3], var[3];              /* var: of the mean */
    double jac[3 * SCATTERING_MAX_FLAT]; /* d mean[c] / d flat param p at [c * n_flat + p], by internal unit, with
                                             n_flat = n_param of the model * number of sets */
    double jac_var[3 * SCATTERING_MAX_FLAT];
    uint64_t n_path, n_vertex;
};

/* out: n_configuration estimates. STATUS_INVALID (a configuration, a parameter, fewer sets than groups),
 * STATUS_CANCELLED (within 100 ms), STATUS_NUMERIC (naming model and configuration when a NaN appears).
 */
status estimate_run(const struct estimate_request *q, struct thread_pool *pool, const struct progress *progress,
                    struct estimate *out, struct error *err);

#endif
