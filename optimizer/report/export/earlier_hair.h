/* Hair materials that an earlier export of the same job has fitted, taken from the result that a job shows (option
 * fit.result_file). Later exports then equal the first one, and take seconds. */
#ifndef SELVEDGE_OPTIMIZER_EARLIER_HAIR_H
#define SELVEDGE_OPTIMIZER_EARLIER_HAIR_H

#include "optimizer/report/export/export_scene.h"

/* Fills the mixtures of all groups of e and e->hair_error, if the result holds them for this model with these
 * parameters on this cloth; *found says whether it does. A result that lacks them, or has others, is no error.
 * STATUS_NO_MEMORY; errors of foreign_json_read. */
status earlier_hair_read(struct export_scene *e, bool *found, struct error *err);

#endif
