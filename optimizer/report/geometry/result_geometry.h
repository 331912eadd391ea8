/* The section "geometry" of result.json and quality.json (keys: docs/file-formats.md). */
#ifndef SELVEDGE_OPTIMIZER_RESULT_GEOMETRY_H
#define SELVEDGE_OPTIMIZER_RESULT_GEOMETRY_H

#include "optimizer/report/findings/report.h"

#include <jansson.h>

json_t *result_geometry_json(const struct report *report);
/* The job's warnings so far. */
json_t *result_warnings_json(struct report *report);

#endif
