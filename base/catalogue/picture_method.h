/* The ways to render a picture, from the table picture_methods.def. */
#ifndef SELVEDGE_BASE_PICTURE_METHOD_H
#define SELVEDGE_BASE_PICTURE_METHOD_H

#include <stdbool.h>
#include <stddef.h>

/* Words of a job document in the order of the table, NULL-terminated. */
extern const char *const picture_method_name[];
/* Whether method i makes its tables in the flat cloth of the job, over the job's black sheet. */
bool picture_method_of_flat_cloth(size_t i);

#endif
