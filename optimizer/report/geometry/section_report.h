/* The sections of the fibers in the reports: as JSON, as a table of the quality page, and as a plot. */
#ifndef SELVEDGE_OPTIMIZER_SECTION_REPORT_H
#define SELVEDGE_OPTIMIZER_SECTION_REPORT_H

#include "optimizer/report/findings/report.h"

#include <jansson.h>
#include <stdbool.h>
#include <stdio.h>

/* Returns whether the fibers in use have sections or radii that vary. */
bool section_report_applies(const struct report *report);
/* The key "sections" of "geometry"; null where it does not apply, or when memory is out. */
json_t *section_report_json(const struct report *report);
/* A table and the plot in quality.html; nothing where it does not apply. */
void section_report_table(const struct report *report, FILE *out);
/* An SVG document: shares of the length over the ratio of the axes. */
void section_report_plot(const struct report *report, FILE *out);

#endif
