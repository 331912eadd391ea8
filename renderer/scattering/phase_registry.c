#include "renderer/scattering/phase_model.h"

#include <string.h>

#define SURFACE_MODEL(...)
#define VOLUME_MODEL(name, ...) extern const struct phase_model phase_##name;
#include "base/catalogue/models.def"
#undef VOLUME_MODEL

static const struct phase_model *const registry[] = {
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
