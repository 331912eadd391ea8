/* results/export/<format>/: the fitted cloth for other programs, as the job document asks for. conversion.json in each
 * folder has what "exports" of result.json says of it: the materials found, and how near they come to the fitted
 * ones. */
#ifndef SELVEDGE_OPTIMIZER_EXPORTS_H
#define SELVEDGE_OPTIMIZER_EXPORTS_H

#include "optimizer/report/findings/report.h"

/* Writes the folders for the best model and adds one object each to report->exports. A best model that sees no
 * fibers, and what a scene lacks, are warnings of the job. */
status exports_write(struct report *report, struct error *err);

#endif
