/* What the model files and the registry share; nothing outside this folder includes it. */
#ifndef SELVEDGE_RENDERER_SCATTERING_REGISTRY_H
#define SELVEDGE_RENDERER_SCATTERING_REGISTRY_H

#include "renderer/scattering/scattering.h"

extern const struct scattering_model scattering_two_lobe;
extern const struct scattering_model scattering_two_lobe_balanced;
extern const struct scattering_model scattering_isotropic;
extern const struct scattering_model scattering_kajiya_kay;
extern const struct scattering_model scattering_marschner;

/* STATUS_INVALID, field = parameter name, for NaN or a value outside its bounds. */
status scattering_check_param(const struct scattering_model *m, const double *param, struct error *err);

#endif
