/* Measures the gain by the corrections of scanned or given fibers: fits the same model to the fibers without
 * corrections, and scores both fits on the held-out rows. */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_CORRECTION_H
#define SELVEDGE_OPTIMIZER_PIPELINE_CORRECTION_H

#include "optimizer/stages/fit_stages.h"

/* Share of the progress of a fit that this step takes. */
#define PIPELINE_CORRECTION_SHARE 0.25

/* Returns whether the job has corrections fitted. */
bool pipeline_correction_applies(const struct job_cloth *cloth, const struct cloth_numbers *number);

/* Fits the parameters to the uncorrected fibers, with as many paths as the final fit of the corrected ones, and fills
 * in fit->scan_error.uncorrected. An interrupted comparison starts over, with the same result. */
status pipeline_correction_compare(const struct fit_input *in, size_t i_model, const struct progress *progress,
                                   struct model_fit *fit, struct error *err);

#endif
