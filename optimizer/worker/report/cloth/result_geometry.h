/* The section "geometry" of result.json and quality.json (keys: docs/file-formats.md). */
#ifndef SELVEDGE_OPTIMIZER_RESULT_GEOMETRY_H
#define SELVEDGE_OPTIMIZER_RESULT_GEOMETRY_H

#include "optimizer/worker/pipeline_context.h"

#include <jansson.h>

json_t *result_geometry_json(const struct pipeline_context *c);
/* The job's warnings so far. */
json_t *result_warnings_json(struct pipeline_context *c);

#endif
