/* What the phase-function files and their registry share; nothing outside this folder includes it. */
#ifndef SELVEDGE_RENDERER_PHASE_REGISTRY_H
#define SELVEDGE_RENDERER_PHASE_REGISTRY_H

#include "renderer/scattering/phase_model.h"

#define SURFACE_MODEL(name, ...)
#define VOLUME_MODEL(name, ...) extern const struct phase_model phase_##name;
#include "base/catalogue/models.def"

#endif
