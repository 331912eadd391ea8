/* Contrasts of all photographs' configurations at a model's result: a part of the stage "validation". */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_CONTRAST_H
#define SELVEDGE_OPTIMIZER_PIPELINE_CONTRAST_H

#include "optimizer/worker/pipeline_context.h"

/* Fills validation.contrast (allocated) of the model by two replicas with n_path paths a row each, through a journal of
 * its own. Nothing to do without c->contrast. */
status pipeline_validate_contrast(struct pipeline_context *c, size_t i_model, const size_t *n_path,
                                  const struct progress *progress, struct error *err);

/* What the renderings of observation i show and its standard error, from both replicas. */
void pipeline_rendered_contrast(const struct pipeline_model *m, size_t i, double contrast_rgb[3], double se_rgb[3]);

#endif
