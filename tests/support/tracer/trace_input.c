#include "tests/support/tracer/trace_input.h"

#include <string.h>

struct radiance_input trace_input_surface(const struct scene *scene, const struct scattering_model *m,
                                          const double *param, struct appearance *model)
{
    appearance_from_surface(m, model);
    return (struct radiance_input){.scene = {.fibers = scene}, .model = model, .param = param};
}

struct radiance_input trace_input_volume(const struct volume_scene *scene, const struct phase_model *m,
                                         const double *param, double multiplier_per_m, struct trace_volume *storage)
{
    appearance_from_volume(m, &storage->model);
    memcpy(storage->param, param, m->n_param * sizeof *param);
    storage->param[m->n_param] = multiplier_per_m;
    return (struct radiance_input){.scene = {.volume = scene}, .model = &storage->model, .param = storage->param};
}
