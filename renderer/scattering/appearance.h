/* The appearance that a fit chooses: a cloth of fibers with a scattering model of their surfaces, or a cloth as a
 * volume with a phase function. Both are seen as one thing with an id and a flat list of parameters, so that nothing
 * beyond the renderer has to know which kind it deals with.
 *
 * A surface model has the parameters of its scattering model. A volume model has the parameters of its phase model, and
 * then the density multiplier d ("density_multiplier", 1/m inside, 1/cm in files), the extinction of full density
 * across the fibers: the published volume fits hold it at 4000 1/cm. Ids come from the two registries; no id is in
 * both.
 */
#ifndef SELVEDGE_RENDERER_APPEARANCE_H
#define SELVEDGE_RENDERER_APPEARANCE_H

#include "renderer/scattering/phase_model.h"
#include "renderer/scattering/scattering.h"

struct appearance {
    enum model_kind kind;
    const char *id, *title;
    size_t n_param;
    const struct param_info *param;
    const struct scattering_model *surface; /* MODEL_SURFACE, otherwise NULL */
    const struct phase_model *volume;       /* MODEL_VOLUME, otherwise NULL */
};

/* Sets *a to the i-th model, surface models first. Returns false when i is beyond the last. */
bool appearance_at(size_t i, struct appearance *a);
/* False when no model has that id. */
bool appearance_find(const char *id, struct appearance *a);
void appearance_from_surface(const struct scattering_model *m, struct appearance *a);
void appearance_from_volume(const struct phase_model *m, struct appearance *a);
/* Index of a flat parameter by name, or -1. */
int appearance_param_index(const struct appearance *a, const char *name);

#endif
