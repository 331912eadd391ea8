/* Prints a job's JSON as text for people. The functions only read JSON and write to a stream. Unknown and missing
 * members are skipped and never cause an error. */
#ifndef SELVEDGE_CLIENTS_CLI_REPORT_H
#define SELVEDGE_CLIENTS_CLI_REPORT_H

#include "clients/cli/text/cli_text.h"
#include "clients/cli/text/text_table.h"

#include <jansson.h>
#include <stdio.h>

/* Extracts the members of a job that progress lines show. */
void report_view(const json_t *job, struct job_view *view);
/* Prints several lines of a job, to which cli_add_result has added its result: sample, state, stage, times, files,
 * warnings and error, then the result if there is one. */
void report_job(const json_t *job, FILE *out);
/* Prints the fitted parameters with standard errors and remarks, and the residuals. */
void report_result(const json_t *job, FILE *out);
/* A list of jobs: the titles of its columns, and the row of a job (text_table.h). */
extern const char *const report_list_head[];
void report_list_add(const json_t *job, struct text_table *table);

/* Prints a list of {"field", "detail"}, a line each behind the label. Returns how many there are. */
size_t cli_print_faults(const json_t *list, const char *label, FILE *out);
/* Prints the statements of files, a sentence each (base/files/file_ledger_json.h). */
void cli_print_statements(const json_t *files, FILE *out);

#endif
