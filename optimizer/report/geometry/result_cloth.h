/* A described cloth in result.json: its numbers and the cloth that was made by them. */
#ifndef SELVEDGE_OPTIMIZER_RESULT_CLOTH_H
#define SELVEDGE_OPTIMIZER_RESULT_CLOTH_H

#include "geometry/cloth/cloth.h"

#include <jansson.h>

/* {weave, seed, numbers: [{name, value, unit, fitted, lower, upper}], made: {...}, description: the section "cloth" of
 * a job that takes this cloth}. number: the values; NULL: the values of d. */
json_t *result_cloth_json(const struct cloth_description *d, const double *number, const struct cloth_report *r);

#endif
