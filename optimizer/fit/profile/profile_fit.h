/* Fits a scattering model to the profile of a single fiber, by damped Gauss-Newton steps (Levenberg-Marquardt) in fit
 * coordinates, with the bounds, ties, priors and starts of fit_layout.h and with a scale between profile and model.
 *
 *   minimised: sum over values m of ((s L - m) / e)^2 + priors,   e^2 = se^2 + (t (m + 0.02 mean of m))^2
 *
 * Where the profile has azimuths of the light and the model distinguishes them, the turn of the section is an unknown
 * too, of which every start scans half a turn first (profile_search.h).
 *
 * s is the scale, L the model's radiance (profile_model.h), se the stated error and t the relative misfit: the
 * residuals beyond the stated errors, chosen so that the sum is the number of values less the number of unknowns, and 0
 * where the stated errors explain the residuals. Without stated errors all of e is misfit, and the fit is one of
 * relative residuals, like the published one of logarithms (Yan et al. 2017, section 5.1), which a value of 0 does not
 * break.
 *
 * Standard errors: the larger one, for each unknown, of two covariances: one for independent residuals of variance e^2,
 * and the sandwich with the residuals of groups of rows of neighbouring phi, in which the misfit of neighbours goes
 * together. It is the sandwich that counts where the model does not describe the fiber exactly. */
#ifndef SELVEDGE_OPTIMIZER_PROFILE_FIT_H
#define SELVEDGE_OPTIMIZER_PROFILE_FIT_H

#include "optimizer/fit/profile/profile_problem.h"

/* A profile is fitted from at least so many starts: the model's own and others spread over the bounds. */
enum { PROFILE_LEAST_START = 4 };

/* Starts of a fit with this option. */
size_t profile_fit_starts(const struct fit_option *option);
/* Memory that a fit of n_start starts takes besides the profile and the states of its model. */
size_t profile_fit_bytes(const struct fiber_profile *profile, size_t n_param, size_t n_start);

/* STATUS_INVALID with the field OPTION_PROFILE_FILE for fewer values than unknowns, OPTION_PROFILE_MODE for a mode that
 * the model does not have alone, which the check of a job document refuses first; STATUS_CANCELLED; errors of
 * fit_layout_init and of the model. */
status profile_fit_run(const struct profile_problem *problem, const char *table_name, struct profile_fit *fit,
                       struct error *err);
void profile_fit_release(struct profile_fit *fit);

#endif
