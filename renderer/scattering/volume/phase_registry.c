#include "renderer/scattering/volume/phase_registry.h"

#include "renderer/scattering/surface/scattering_registry.h"

#include <string.h>

static const struct phase_model *const registry[] = {
#define SURFACE_MODEL(name, ...)
#define VOLUME_MODEL(name, ...) &phase_##name,
#include "base/catalogue/models.def"
    NULL,
};

const struct phase_model *const *phase_registry(void) { return registry; }

const struct phase_model *phase_find(const char *id)
{
    for (size_t i = 0; registry[i] != NULL; i++)
        if (strcmp(registry[i]->id, id) == 0) return registry[i];
    return NULL;
}

status phase_check_param(const struct phase_model *m, const double *param, struct error *err)
{
    const struct scattering_model described = {.id = m->id, .n_param = m->n_param, .param = m->param};
    return scattering_check_param(&described, param, err);
}
