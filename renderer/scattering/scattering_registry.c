/* The models of fibers and of volumes, in the order of their rows. */
#include "renderer/scattering/phase_model.h"
#include "renderer/scattering/scattering.h"

#include <math.h>
#include <string.h>

#define SURFACE_MODEL(name, ...) extern const struct scattering_model scattering_##name;
#define VOLUME_MODEL(name, ...) extern const struct phase_model phase_##name;
#include "base/catalogue/models.def"
#undef SURFACE_MODEL
#undef VOLUME_MODEL

static const struct scattering_model *const surface_models[] = {
#define SURFACE_MODEL(name, ...) &scattering_##name,
#define VOLUME_MODEL(...)
#include "base/catalogue/models.def"
    NULL,
};
#undef SURFACE_MODEL
#undef VOLUME_MODEL

static const struct phase_model *const volume_models[] = {
#define SURFACE_MODEL(...)
#define VOLUME_MODEL(name, ...) &phase_##name,
#include "base/catalogue/models.def"
    NULL,
};

const struct scattering_model *const *scattering_registry(void) { return surface_models; }

const struct scattering_model *scattering_find(const char *id)
{
    for (size_t i = 0; surface_models[i] != NULL; i++)
        if (strcmp(surface_models[i]->id, id) == 0) return surface_models[i];
    return NULL;
}

const struct phase_model *const *phase_registry(void) { return volume_models; }

const struct phase_model *phase_find(const char *id)
{
    for (size_t i = 0; volume_models[i] != NULL; i++)
        if (strcmp(volume_models[i]->id, id) == 0) return volume_models[i];
    return NULL;
}

int scattering_param_index(const struct scattering_model *m, const char *name)
{
    return param_index(m->param, m->n_param, name);
}

status scattering_prepare(const struct scattering_model *m, const double *param, struct thread_pool *pool,
                          struct scattering_state **state, struct error *err)
{
    return pool != NULL && m->prepare_shared != NULL ? m->prepare_shared(param, pool, state, err)
                                                     : m->prepare(param, state, err);
}

const char *scattering_frame_reason(const struct scattering_model *m)
{
    if (m->flat_section) return "its fibers are flat";
    return m->near_field ? "its light depends on where across the fiber it is seen" : NULL;
}

double scattering_view_azimuth_rad(const struct scattering_model *m, int k, int n)
{
    if (m->near_field) return asin((2 * k + 1.0) / n - 1);
    return m->flat_section ? 2 * M_PI * (k + 0.5) / n : 0;
}
