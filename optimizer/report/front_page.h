/* The first two pages of report.html, for someone who wants the result and no details: a picture of the cloth, the
 * verdict and four numbers; then the parameters in words, measured against rendered, and the geometry in one figure. */
#ifndef SELVEDGE_OPTIMIZER_FRONT_PAGE_H
#define SELVEDGE_OPTIMIZER_FRONT_PAGE_H

#include "optimizer/report/findings/report.h"

#include <jansson.h>
#include <stdio.h>

/* data: report.json; head: the letterhead (letterhead_file.h). STATUS_NO_MEMORY, STATUS_IO. */
status front_pages(struct report *report, const json_t *data, const json_t *head, FILE *out, struct error *err);

/* ---- parts ---- */

/* The parameters of the best model or, without a fit, the given ones, and the fitted numbers of the cloth: a table of
 * meanings, values with errors and remarks. Parameters that do not fit onto a page are left to the appendix. */
void front_parameters(const struct report *report, const json_t *result, FILE *out);

#endif
