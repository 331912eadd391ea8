/* What the model files and the registry share; nothing outside this folder includes it. */
#ifndef SELVEDGE_RENDERER_SCATTERING_REGISTRY_H
#define SELVEDGE_RENDERER_SCATTERING_REGISTRY_H

#include "renderer/scattering/scattering.h"

#define SURFACE_MODEL(name, ...) extern const struct scattering_model scattering_##name;
#define VOLUME_MODEL(name, ...)
#include "base/catalogue/models.def"

#endif
