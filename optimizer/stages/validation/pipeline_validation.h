/* The stage "validation" as others see it. */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_VALIDATION_H
#define SELVEDGE_OPTIMIZER_PIPELINE_VALIDATION_H

struct job_fit;

/* Paths that the validation of a model may take whose fit has taken n_fit_path. It takes fewer where rendered means
 * become precise enough with less. */
double pipeline_validation_paths(const struct job_fit *fit, double n_fit_path);
/* Paths that it may take beyond these for the fitted rows that give a discrepancy. */
double pipeline_factor_paths(const struct job_fit *fit, double n_fit_path);
/* Paths of the run before it that shows the noise of each row. */
double pipeline_pilot_paths(double n_fit_path);

#endif
