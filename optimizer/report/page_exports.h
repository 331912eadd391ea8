/* The files for other programs on a page: their errors over the rows and in each row, and what to know of them. */
#ifndef SELVEDGE_OPTIMIZER_PAGE_EXPORTS_H
#define SELVEDGE_OPTIMIZER_PAGE_EXPORTS_H

#include "optimizer/report/findings/report.h"

/* report->exports under a heading of its own; nothing without one. */
void page_exports(const struct report *report, FILE *out);

#endif
