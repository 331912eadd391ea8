/* A described cloth as the section "cloth" of a job document, which describes the same cloth again. */
#ifndef SELVEDGE_OPTIMIZER_CLOTH_JSON_H
#define SELVEDGE_OPTIMIZER_CLOTH_JSON_H

#include "base/catalogue/cloth_description.h"

#include <jansson.h>

/* number: the values; NULL: the values of d. Numbers are given, not searched. NULL when memory is short. */
json_t *cloth_section_json(const struct cloth_description *d, const double *number);
/* The draft as texts, the upper row first. */
json_t *cloth_draft_json(const struct cloth_description *d);

#endif
