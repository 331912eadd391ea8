/* The letterhead of a report, which the daemon puts into the folder of a job. */
#ifndef SELVEDGE_OPTIMIZER_LETTERHEAD_FILE_H
#define SELVEDGE_OPTIMIZER_LETTERHEAD_FILE_H

#include "optimizer/report/findings/report.h"

#include <jansson.h>

/* Returns letterhead.json, freed by the caller: {"laboratory", "logo", "paper"}; an empty object where there is none.
 * A logo that is no "data:image/..." in base64 is left out, so the page never loads anything. */
json_t *letterhead_file_read(const struct report *report);

#endif
