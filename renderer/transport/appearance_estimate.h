/* Estimates of mean radiance for either kind of cloth: estimate.h or volume_estimate.h, as the model asks. Same result,
 * units and rules; derivatives are by the flat parameters of the appearance, jac[c * model->n_param + p].
 */
#ifndef SELVEDGE_RENDERER_APPEARANCE_ESTIMATE_H
#define SELVEDGE_RENDERER_APPEARANCE_ESTIMATE_H

#include "renderer/scattering/appearance.h"
#include "renderer/transport/estimate.h"
#include "renderer/transport/volume/volume_scene.h"

/* One cloth in the forms that there are of it. */
struct appearance_scene {
    const struct scene *fibers;        /* NULL: no surface model can be estimated */
    const struct volume_scene *volume; /* NULL: no volume model can be estimated */
};

/* STATUS_INVALID, field "model", when the cloth lacks the form that the model needs; what: "render", "check". */
status appearance_scene_check(const struct appearance_scene *scene, const struct appearance *model, const char *what,
                              struct error *err);

struct appearance_request {
    struct appearance_scene scene;
    const struct appearance *model;
    const double *param; /* model->n_param, internal units */
    const struct configuration *configuration;
    size_t n_configuration;
    const size_t *n_path; /* per configuration */
    uint64_t seed;
    uint32_t iteration, replica;
    bool want_jacobian;
    bool no_probes; /* estimate.h; volumes have none */
};

/* What estimate_run or volume_estimate_run give, and means over rotations where a configuration asks for them (rotation_mean.h;
 * every rotation counts as a configuration of its own); appearance_scene_check's errors. */
status appearance_estimate_run(const struct appearance_request *q, struct thread_pool *pool,
                               const struct progress *progress, struct estimate *out, struct error *err);

/* Paths that are traced for a configuration of which n_path (more than 0) are asked: whole blocks, of every rotation; as many
 * for every part of a contrast. */
size_t appearance_n_path(const struct configuration *c, size_t n_path);

#endif
