/* Path-traced estimates of mean radiance over a photograph's crop, with derivatives by every parameter of the model
 * from the same paths (fabric thesis 5.5.1, figure 5.3), for fibers and for volumes. Every figure carries the variance
 * of its mean. Results depend on the key and the counts only: bit-identical for any number of threads.
 */
#ifndef SELVEDGE_RENDERER_ESTIMATE_H
#define SELVEDGE_RENDERER_ESTIMATE_H

#include "base/thread_pool.h"
#include "renderer/estimate/radiance_source.h"

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

enum { ESTIMATE_MAX_PARTNER = 15 };
/* An earlier configuration that was estimated from the same camera paths. correlation: covariance of the two means over
 * the product of their standard deviations, both summed over the channels; in [-1, 1]. */
struct estimate_partner {
    uint32_t configuration;
    float correlation;
};

/* rgb means in radiance units. For a configuration with contrast_cells: its contrast and the derivatives of that. For
 * one with n_rotation: the mean over its rotations, each of which counts as a configuration of its own. */
struct estimate {
    double mean[3], var[3];              /* var: of the mean */
    double jac[3 * SCATTERING_MAX_FLAT]; /* d mean[c] / d flat param p at [c * n_flat + p], by internal unit, with
                                            n_flat = n_param of the model * number of sets */
    double jac_var[3 * SCATTERING_MAX_FLAT];
    uint64_t n_path, n_bounce;
    uint32_t n_partner; /* of a mean over rotations that shares its paths with more rows: the first ones */
    struct estimate_partner partner[ESTIMATE_MAX_PARTNER];
};

/* out: n_configuration estimates. STATUS_INVALID (a configuration, a parameter, fewer sets than groups, a cloth without
 * the form that the model needs), STATUS_CANCELLED (within 100 ms), STATUS_NUMERIC (naming model and configuration when
 * a NaN appears).
 */
status estimate_run(const struct estimate_request *q, struct thread_pool *pool, const struct progress *progress,
                    struct estimate *out, struct error *err);

/* For estimates that are moved to other places of an array: replaces the number k of each partner by place[k], and
 * leaves out partners whose place is SIZE_MAX. */
void estimate_move_partners(struct estimate *e, const size_t *place);

/* Paths that are traced for a configuration of which n_path (more than 0) are asked: whole blocks of
 * RADIANCE_BLOCK_PATHS, for every rotation; as many for every part of a contrast. */
size_t estimate_n_path(const struct configuration *c, size_t n_path);

#endif
