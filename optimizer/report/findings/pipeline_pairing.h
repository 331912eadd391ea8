/* Photographs in another order of the cloth's rotation than the job states: the finished fit describes them better when
 * photographs of one lamp and camera change places. */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_PAIRING_H
#define SELVEDGE_OPTIMIZER_PIPELINE_PAIRING_H

#include "optimizer/report/findings/report.h"

/* Warns when the measurements of every lamp and camera, in reverse order of their rotations or moved on by one or one
 * back, differ from each other much more as the best model's renderings do. After validation. STATUS_NO_MEMORY. */
status pipeline_warn_pairing(struct report *report, struct error *err);

#endif
