/* The verdict as JSON: key "verdict" of result.json, status.json and the API's jobs. */
#ifndef SELVEDGE_OPTIMIZER_VERDICT_JSON_H
#define SELVEDGE_OPTIMIZER_VERDICT_JSON_H

#include "optimizer/report/findings/verdict.h"

#include <jansson.h>

/* {"code", "words", "text", "judged_by", "rel_rms", "rel_rms_se", "allowed_rel_rms", "one_color_rel_rms",
 * "plain_brdf_rel_rms", "reservations": [{"code", "text"}]}. The numbers are null without a fit; null as a whole when
 * there is nothing to judge. The caller owns it. */
json_t *verdict_json(const struct verdict *v);

#endif
