/* The JSON of workers, reduced to the kinds and ranges that the API promises. */
#ifndef SELVEDGE_SERVER_WORKER_WORDS_H
#define SELVEDGE_SERVER_WORKER_WORDS_H

#include <jansson.h>

/* Each removes the members that no sound worker writes: from status.json, from a plan, from the findings of a check,
 * and from a list of inputs in report.json or version.json. */
void worker_words_of_status(json_t *status);
void worker_words_of_plan(json_t *plan);
void worker_words_of_check(json_t *report);
void worker_words_of_inputs(json_t *inputs);

#endif
