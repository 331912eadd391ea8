/* What a worker says of its job, as far as it has the kinds and ranges that the API promises. */
#ifndef SELVEDGE_SERVER_WORKER_WORDS_H
#define SELVEDGE_SERVER_WORKER_WORDS_H

#include <jansson.h>

/* Each takes out what a worker would not say: of status.json, of a plan, of what a check found, and of a list of inputs
 * in report.json or version.json. */
void worker_words_of_status(json_t *status);
void worker_words_of_plan(json_t *plan);
void worker_words_of_check(json_t *report);
void worker_words_of_inputs(json_t *inputs);

#endif
