#include "renderer/scattering/surface/scattering_registry.h"

#include <string.h>

static const struct scattering_model *const registry[] = {
#define SURFACE_MODEL(name, ...) &scattering_##name,
#define VOLUME_MODEL(name, ...)
#include "base/catalogue/models.def"
    NULL,
};

const struct scattering_model *const *scattering_registry(void) { return registry; }

const struct scattering_model *scattering_find(const char *id)
{
    for (size_t i = 0; registry[i] != NULL; i++)
        if (strcmp(registry[i]->id, id) == 0) return registry[i];
    return NULL;
}

int scattering_param_index(const struct scattering_model *m, const char *name)
{
    return param_index(m->param, m->n_param, name);
}
