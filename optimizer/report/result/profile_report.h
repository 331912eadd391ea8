/* The results of a job with the profile of a fiber: the profile, and the models fitted to it.
 *
 * "profile" of result.json:
 *   "table"      file, n_row, n_channel, has_errors, the ranges of theta_i_deg, theta_o_deg and phi_deg, where the
 *                profile has it of phi_i_deg, and the mode where it shows one alone
 *   "chosen_by"  "bic": the best model has the least profile_fit.bic
 *   "csv"        name of the table of measured and fitted radiances, of all models
 *   "models"     of each: id, title, best, parameters, scale and its error, for a flat section with phi_i_deg also
 *                turn_deg, turn_se_deg, turn_fitted, turn_determined, then nrmse, rel_rms, misfit, chi_square, bic,
 *                n_unknown, n_start, n_agree, n_evaluation, converged, fit_wall_s (profile_fit.h) */
#ifndef SELVEDGE_OPTIMIZER_PROFILE_REPORT_H
#define SELVEDGE_OPTIMIZER_PROFILE_REPORT_H

#include "optimizer/report/findings/report.h"

#include <stdio.h>

/* result.json of such a job. */
status profile_json_write(struct report *report, struct error *err);
/* results/profile.csv: theta_i_deg, phi_i_deg where the profile has it, theta_o_deg, phi_deg, channel, radiance, and
 * the radiance by each model; one line for each row and channel. */
status profile_csv_write(const struct report *report, struct error *err);
/* The residuals of model i in the summary. */
void profile_print(const struct report *report, size_t i, FILE *out);
/* The residuals of model i and charts of the radiance over phi, measured and fitted, in the page. */
void profile_page(const struct report *report, size_t i, FILE *out);
/* At most `most` of these charts, spread over the directions. */
void profile_charts(const struct report *report, size_t i, size_t most, FILE *out);

#endif
