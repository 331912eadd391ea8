/* Numbers and lists of numbers as JSON. A number that is not finite becomes null. */
#ifndef SELVEDGE_OPTIMIZER_JSON_NUMBER_H
#define SELVEDGE_OPTIMIZER_JSON_NUMBER_H

#include <jansson.h>
#include <stddef.h>

json_t *json_number(double v);
json_t *json_count(size_t n);
json_t *json_number_list(const double *v, size_t n, double factor);
json_t *json_count_list(const size_t *v, size_t n);

#endif
