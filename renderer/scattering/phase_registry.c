#include "renderer/scattering/phase_registry.h"

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
