/* The errors that exports state, as result.json has them, and their part of summary.txt. */
#ifndef SELVEDGE_OPTIMIZER_EXPORT_SUMMARY_H
#define SELVEDGE_OPTIMIZER_EXPORT_SUMMARY_H

#include "optimizer/report/findings/report.h"

/* errors: "row_rel_errors" of an export, or NULL. Returns NaN where row i has none. */
double export_error_of(const json_t *errors, size_t i);
/* The row with the largest error; 0 where none is stated. */
size_t export_worst_row(const json_t *errors);
/* Its name, "" where none is stated. */
const char *export_worst_name(const struct report *report, const json_t *errors);
/* Prints all of report->exports as text; nothing where there are none. */
void export_summary_print(const struct report *report, FILE *out);

#endif
