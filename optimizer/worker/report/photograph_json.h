/* How a photograph became radiances, as JSON: for the rows of result.json and for previews. */
#ifndef SELVEDGE_OPTIMIZER_PHOTOGRAPH_JSON_H
#define SELVEDGE_OPTIMIZER_PHOTOGRAPH_JSON_H

#include "optimizer/fit/photographs/photograph.h"

#include <jansson.h>

/* {"format", "bits", "less_trustworthy", "exposure_s", ...}; what is not known is null. NULL for a row of a table. */
json_t *photograph_record_json(const struct photograph_record *r);

#endif
