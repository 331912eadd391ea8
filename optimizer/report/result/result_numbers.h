/* The fitted numbers of a cloth in the results: values, errors, and numbers that the photographs do not determine. */
#ifndef SELVEDGE_OPTIMIZER_RESULT_NUMBERS_H
#define SELVEDGE_OPTIMIZER_RESULT_NUMBERS_H

#include "optimizer/report/findings/report.h"

#include <jansson.h>
#include <stdio.h>

/* Adds "cloth_numbers" and "cloth_screening" to the results of a model's fit (docs/file-formats.md); nothing when no
 * number is fitted. */
void result_numbers_put(json_t *json, const struct report *report, const struct pipeline_model *m);
/* Writes a line for each number; nothing when no number is fitted. */
void result_numbers_print(const struct report *report, const struct pipeline_model *m, FILE *out);

#endif
