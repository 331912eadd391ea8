/* A job's JSON as text for people. Pure: reads JSON, writes to a stream. Unknown or missing members are left out, never an error. */
#ifndef SELVEDGE_CLIENTS_CLI_REPORT_H
#define SELVEDGE_CLIENTS_CLI_REPORT_H

#include "clients/cli/cli_text.h"

#include <jansson.h>
#include <stdio.h>

/* The members of a job that progress lines show. */
void report_view(const json_t *job, struct job_view *view);
/* Several lines: sample, state, stage, times, files, warnings, error; and the result when there is one. */
void report_job(const json_t *job, FILE *out);
/* Fitted parameters with standard errors and flags, and the residuals. */
void report_result(const json_t *job, FILE *out);
/* One line of a list. */
void report_summary(const json_t *job, FILE *out);

#endif
