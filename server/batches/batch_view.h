/* The JSON of batches, as docs/api.md describes it. */
#ifndef SELVEDGE_SERVER_BATCH_VIEW_H
#define SELVEDGE_SERVER_BATCH_VIEW_H

#include "server/jobs/job_service.h"
#include "server/store/store_batch.h"

/* A batch in a list: name, times and the number of its jobs in each state. */
status batch_summary(struct job_service *v, const struct batch_row *row, json_t **view, struct error *err);
/* The whole batch: besides, template, progress, expected end, verdicts and failures with their reasons. */
status batch_view(struct job_service *v, const struct batch_row *row, json_t **view, struct error *err);

/* The table of results, a row for each sample: parameters with standard errors, verdict, errors of the fit, flags. It
 * reads the result of every job that has one. verdicts: codes as in job_query.verdict, to which the rows are limited;
 * "": all rows. */
status batch_results(struct job_service *v, const char *id, const char *verdicts, json_t **table, struct error *err);
/* That table as CSV (RFC 4180), with a value and a standard error for each parameter that any sample has. NULL: out of
 * memory. The caller frees it. */
char *batch_results_csv(const json_t *table);

#endif
