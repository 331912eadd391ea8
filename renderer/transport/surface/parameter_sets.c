#include "renderer/transport/surface/parameter_sets.h"
#include "renderer/scene/scene_ray.h"

#include <string.h>

status parameter_sets_init(struct parameter_sets *s, const struct scene *scene, const struct scattering_model *model,
                           const double *param, size_t n_set, struct error *err)
{
    memset(s, 0, sizeof *s);
    s->model = model;
    s->films = *scene_films(scene);
    s->n = n_set > 1 ? n_set : 1;
    if (s->n > SCATTERING_MAX_SET || s->n * model->n_param > SCATTERING_MAX_FLAT)
        return error_set_field(err, STATUS_INVALID, "n_set",
                               "cannot use %zu parameter sets of model '%s': at most %d sets and %d parameters in all",
                               n_set, model->id, SCATTERING_MAX_SET, SCATTERING_MAX_FLAT);
    if (s->n > 1 && s->n < scene_n_group(scene))
        return error_set_field(err, STATUS_INVALID, "n_set",
                               "cannot use %zu parameter sets for a cloth of %zu material groups", n_set,
                               scene_n_group(scene));
    for (size_t i = 0; i < s->n; i++) {
        status st = model->prepare(param + i * model->n_param, &s->state[i], err);
        if (st != STATUS_OK) return st;
    }
    return STATUS_OK;
}

void parameter_sets_release(struct parameter_sets *s)
{
    for (size_t i = 0; i < s->n && i < SCATTERING_MAX_SET; i++)
        if (s->state[i] != NULL) s->model->release(s->state[i]);
}
