/* The part of the stage "validation" that estimates the contrasts of all photographs' configurations at a model's
 * result. */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_CONTRAST_H
#define SELVEDGE_OPTIMIZER_PIPELINE_CONTRAST_H

#include "optimizer/stages/fit_stages.h"

/* Fills v->contrast with two replicas of n_path paths per row, through a
 * journal of its own. Without rows of contrasts it does nothing. */
status pipeline_validate_contrast(const struct validation_input *in, size_t i_model, const size_t *n_path,
                                  const struct progress *progress, struct validation *v, struct error *err);

/* Writes the contrast of the renderings of observation i and its standard error, from both replicas. */
void pipeline_rendered_contrast(const struct validation *v, size_t i, double contrast_rgb[3], double se_rgb[3]);

#endif
