/* Carries the errors of scanned fibers into the errors of the scattering parameters.
 *
 * The reconstruction measures them (geometry/reconstruct/reconstruct.h): the radius by two methods, and the direction
 * noise of the axes. They become two numbers of the cloth: a factor of all radii, and the variance of the direction
 * noise in units of the stated one (fiber_roughen.h), where 0 stands for the fibers as they are. After the fit one
 * more estimate traces the cloth as it is and with each of the numbers moved, and the shift of the parameters by each
 * number, times its prior error, is added to their covariance (carried_error.h). The parameters stay as they are. */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_SCAN_ERROR_H
#define SELVEDGE_OPTIMIZER_PIPELINE_SCAN_ERROR_H

#include "optimizer/stages/fit_stages.h"

/* Share of the progress of a fit that this step takes. */
#define PIPELINE_SCAN_ERROR_SHARE 0.2

/* Returns whether the fibers of the job come from a scan, the model sees fibers, and no corrections of them are fitted,
 * whose own errors would then count. */
bool pipeline_scan_error_applies(const struct cloth_job *job, const struct made_cloth *made, size_t i_model);

/* Adds the errors to fit->result, and fills in fit->scan_error, which is all zero where they do not apply. */
status pipeline_scan_error_carry(const struct fit_input *in, size_t i_model, const struct progress *progress,
                                 struct model_fit *fit, struct error *err);

#endif
