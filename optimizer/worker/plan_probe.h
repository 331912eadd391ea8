/* What is measured of a job's own inputs before it runs, because it varies too much for a usual figure: the time that
 * its gradient certificates take, and how much shorter the paths in a thin cloth are. */
#ifndef SELVEDGE_OPTIMIZER_PLAN_PROBE_H
#define SELVEDGE_OPTIMIZER_PLAN_PROBE_H

#include "optimizer/worker/pipeline_plan.h"

/* Sets certificate_s and path_share of a plan whose inputs have been read. Takes the time of one preparation of each
 * model, which is 0.2 s at most, and that of reading the file of fibers where it is small. */
void plan_probe_take(struct job_plan *plan);
/* Time of a path in a cloth over that in a closed one, in (0, 1], by the area of all fibers over that of the tile. */
double plan_probe_path_share(const struct fiber_set *f);

#endif
