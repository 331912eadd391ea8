/* What each stage of a job has to do, in units of work whose speed can be remembered: voxels, paths, seconds of the
 * fit. */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_PLAN_H
#define SELVEDGE_OPTIMIZER_PIPELINE_PLAN_H

#include "optimizer/worker/pipeline_context.h"

/* Plans stage i, of this name (stage_table.h), by what is known now: before the first stage by the job document and the
 * size of its files, later by what earlier stages have found. */
void pipeline_plan_stage(struct pipeline_context *c, const char *name, size_t i);
/* Plans the stage "volume", which runs, anew: the scan has hollow fibers, which are traced to fill their lumens. */
void pipeline_plan_hollow(struct pipeline_context *c);
/* Voxels of the scan: as read, or by the size of its files before. */
double pipeline_plan_voxels(const struct pipeline_context *c);
/* Size of a cloth that is made from its description, 0 where the job has none: of each yarn, its fibers times the
 * square roots of the fibers of the yarns that it crosses, summed, because yarns are as far apart as they are thick; of
 * a felt, so much for each fiber. The vertices of the fibers go with it. With the tile of the last fit. */
double pipeline_plan_cloth_size(const struct pipeline_context *c);
/* Light paths that the fit of one model of this job usually takes, by its rows and where they come from. */
double pipeline_plan_usual_paths(const struct pipeline_context *c);
/* Plans the stages after the fit anew, whose work depends on the paths of the fits: n_path have been traced, and the
 * stage has reached c->stage_fraction. */
void pipeline_plan_fit_paths(struct pipeline_context *c, double n_path);

#endif
