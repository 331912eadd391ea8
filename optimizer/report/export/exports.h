/* results/export/<format>/: the fitted cloth for other programs, as the job document asks for. conversion.json in each
 * folder repeats the folder's entry in "exports" of result.json: the materials found, and how near they come to the
 * fitted ones. */
#ifndef SELVEDGE_OPTIMIZER_EXPORTS_H
#define SELVEDGE_OPTIMIZER_EXPORTS_H

#include "optimizer/report/findings/report.h"

/* Writes the folders for the best model and adds one object each to report->exports. Warns when the best model sees no
 * fibers, and of parts that a scene lacks. */
status exports_write(struct report *report, struct error *err);

#endif
