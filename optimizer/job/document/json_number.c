#include "optimizer/job/document/json_number.h"

#include <math.h>

json_t *json_number(double v) { return isfinite(v) ? json_real(v) : json_null(); }
json_t *json_count(size_t n) { return json_integer((json_int_t)n); }

json_t *json_number_list(const double *v, size_t n, double factor)
{
    json_t *list = json_array();
    for (size_t i = 0; i < n; i++) json_array_append_new(list, json_number(v[i] * factor));
    return list;
}

json_t *json_count_list(const size_t *v, size_t n)
{
    json_t *list = json_array();
    for (size_t i = 0; i < n; i++) json_array_append_new(list, json_count(v[i]));
    return list;
}
