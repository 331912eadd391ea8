/* results/export/<format>/: the fitted cloth for other programs, as the job document asks for. conversion.json in each
 * folder repeats the folder's entry in "exports" of result.json: the materials found, and how near they come to the
 * fitted ones. */
#ifndef SELVEDGE_OPTIMIZER_EXPORTS_H
#define SELVEDGE_OPTIMIZER_EXPORTS_H

#include "optimizer/report/findings/report.h"

/* Number of formats that the job asks for. */
size_t exports_count(const struct job_results *results);
/* Paths of a photograph that take as long as the exports, all of textures, whose pixels are as many as those of the
 * renderings. */
double exports_paths(const struct job_results *results, size_t n_row, double n_fit_path);
/* Writes the folders for the best model and adds one object each to report->exports. Warns when the best model sees no
 * fibers, and of parts that a scene lacks. from, to: shares of the stage before and after. */
status exports_write(struct report *report, double from, double to, struct error *err);

#endif
