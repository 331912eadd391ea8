/* The steps from a photograph to radiances as JSON, for the rows of result.json and for previews. */
#ifndef SELVEDGE_OPTIMIZER_PHOTOGRAPH_JSON_H
#define SELVEDGE_OPTIMIZER_PHOTOGRAPH_JSON_H

#include "optimizer/job/document/job_photograph.h"
#include "optimizer/photographs/camera/photograph_develop.h"

#include <jansson.h>

/* {"format", "bits", "less_trustworthy", "exposure_s", ...}; unknown values are null. NULL for a row of a table. */
json_t *photograph_record_json(const struct photograph_record *r);
/* {"file", "number", "n", "angle_deg", "angle_se_deg"} of the column of a cylinder; NULL for other photographs. */
json_t *photograph_column_json(const char *file, const struct job_column *column);
/* Returns the step from colors to radiances: the matrix and, of a chart, its corners and color differences; null
 * without either. */
json_t *photograph_color_json(const struct photograph_process *k, const struct job_setup *setup);

#endif
