/* What report.html shows of a table of measurements in place of pictures: for each lamp a sphere wrapped in the fitted
 * cloth, and a goniometric plot of its measured and rendered radiances. */
#ifndef SELVEDGE_OPTIMIZER_PAGE_LOBES_H
#define SELVEDGE_OPTIMIZER_PAGE_LOBES_H

#include "optimizer/report/findings/report.h"

#include <jansson.h>
#include <stdio.h>

/* result: result.json of a job with a table. STATUS_NO_MEMORY, STATUS_IO. */
status page_lobes(const struct report *report, const json_t *result, FILE *out, struct error *err);

#endif
