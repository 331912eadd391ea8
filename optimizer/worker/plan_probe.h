/* Measures two properties of a job's own inputs before it runs, because they vary too much for usual figures: the time
 * that its gradient certificates take, and how much shorter the paths in a thin cloth are. */
#ifndef SELVEDGE_OPTIMIZER_PLAN_PROBE_H
#define SELVEDGE_OPTIMIZER_PLAN_PROBE_H

#include "optimizer/worker/pipeline_plan.h"

/* Sets certificate_s, model_s, path_share and file_segments of a plan whose inputs have been read. Prepares each model
 * once, which takes 0.2 s at most, and reads the file of fibers where it is small. */
void plan_probe_take(struct job_plan *plan);
/* Returns the time of a path in a cloth over its time in a closed cloth, in (0, 1], by the area of all fibers over the
 * area of the tile. */
double plan_probe_path_share(const struct fiber_set *f);

#endif
