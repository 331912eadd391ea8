/* results/result.json, and results/summary.txt for people.
 *
 * docs/file-formats.md describes every key of result.json with its unit. The outline:
 *
 *   "format", "sample", "method", "seed"            version of this format, and values of the job document
 *   "model", "chosen_by"                            id of the best model, to which all keys but "models" refer, and
 *                                                   the measure by which it was chosen
 *   "definitions"                                   errors and units, explained in sentences
 *   "exports"                                       files for other programs (docs/exports.md)
 *   "verdict"                                       whether the result can be used (verdict.h)
 *   "converged", "reason", "reason_code"            why the fit ended (stop_reason.h)
 *   "parameters"                                    value, standard error (with photograph noise, Monte-Carlo noise and
 *                                                   misfit), bounds, ties and prior of each parameter, in file units
 *   "correlation"                                   in fit coordinates; 0 for fixed parameters
 *   "objective", "fit_rel_rms", "heldout_rel_rms"   errors of the fit by fresh paths (objective.h), each with "..._se"
 *   "..._channel_rel_rms"                           relative errors of the channels apart, each with "..._se"
 *   "cross_validation"                              error of fitted rows left out in turn (cross_validation.h), or null
 *   "misfit_rel_rms"                                relative error of a residual that no noise explains
 *   "validation_worst_rel_se"                       largest relative standard error of a rendered mean
 *   "prior_penalty", "nuisance", "starts", "next_photograph", "certificate", "..._with_gains"
 *                                                   results of options of the fit (result_options_json.h)
 *   "rows"                                          each measurement: angles, measured and rendered colour, pictures
 *   "models"                                        the keys above for each model, in the order of the job document
 *   "profile"                                       models fitted to the profile of a fiber (profile_report.h)
 *   "radius"                                        the search for the fiber radius, or null
 *   "skill"                                         comparison with a plain BRDF fitted to the same rows
 *                                                   (plain_brdf.h), or null
 *   "geometry", "quality"                           the geometry (result_geometry.h); names of its quality report
 *   "png_exposure"                                  factor from radiance to the values of PNG pictures, before sRGB
 *   "n_path_fit", "n_step", "fit_wall_s", "n_path_validation", "stages"   paths and wall time
 *   "warnings", "program"                           the job's warnings; the program and its version
 *
 * The best model has the lowest error by cross-validation inside the fitted rows (pipeline_choice.h). Numbers have 17
 * digits, so that equal fits give equal bytes. */
#ifndef SELVEDGE_OPTIMIZER_RESULT_JSON_H
#define SELVEDGE_OPTIMIZER_RESULT_JSON_H

#include "base/version.h"
#include "optimizer/job/document/job_file_name.h"
#include "optimizer/report/findings/report.h"

#define RESULT_PROGRAM "selvedge-worker " SELVEDGE_VERSION

/* Names of pictures, one for each observation: unique, without folder and file extension. The caller frees *name. */
typedef char picture_name[JOB_MAX_NAME_BYTES + 8];
status result_picture_names(const struct observation_set *o, picture_name **name, struct error *err);
/* Exposure of all PNG pictures. It brings the 90th percentile of the brightest measured channels to 0.8. */
double result_png_exposure(const struct observation_set *o);

/* Row i as rendered by model m: the mean of both replicas with the fitted nuisance terms (nuisance.h), and its standard
 * error: the figures to compare with the measurement. */
void result_rendered_mean(const struct pipeline_model *m, size_t i, double mean[3], double se[3]);
/* Relative error of row i by model m (objective_row_error), and its standard error: the one error of a row that
 * results, summary, report and dashboard show. */
double result_row_error(const struct report *report, const struct pipeline_model *m, size_t i, double *se);

/* The same of a job that ends with the geometry: without parameters, rows and models. */
status result_geometry_json_write(struct report *report, struct error *err);
/* The same of a job that renders given parameters: without rows, models and a method. */
status result_pictures_json_write(struct report *report, struct error *err);
/* Adds the entries of every job to json, the job's own part of result.json, writes the file, and releases json. */
status result_json_finish(struct report *report, json_t *json, struct error *err);
/* "parameters" of a model. */
json_t *result_parameters_json(const struct pipeline_model *m);
status result_json_write(struct report *report, struct error *err);
status result_summary_write(struct report *report, struct error *err);

#endif
