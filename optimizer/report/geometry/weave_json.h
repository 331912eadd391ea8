/* The weave read from a photograph, as JSON: for people and scripts (selvedge-phantom detect) and for result.json.
 * docs/weave-detection.md lists the members. */
#ifndef SELVEDGE_OPTIMIZER_WEAVE_JSON_H
#define SELVEDGE_OPTIMIZER_WEAVE_JSON_H

#include "geometry/weave/weave_detect.h"

#include <jansson.h>

/* px_per_mm: scale of the photograph; 0: not known, and lengths are in pixels only. NULL without memory. */
json_t *weave_guess_json(const struct weave_guess *guess, double px_per_mm);

/* Rows of a draft as job documents have them: a text of 0 and 1 for each weft, the upper one first. */
json_t *weave_draft_json(const struct weave_draft *draft);

#endif
