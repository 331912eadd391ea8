/* A job that goes on from the geometry of another one: the checkpoints of the other job become its own. */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_ADOPT_H
#define SELVEDGE_OPTIMIZER_PIPELINE_ADOPT_H

#include "optimizer/stages/run/stage_tools.h"

/* Writes the path of another job's folder, which lies beside this one's. false: it is too long. */
bool pipeline_other_folder(const struct worker_folder *own, const char *job, struct worker_folder *other);
/* Links the files of the other job that the next function needs to JOB/adopted/: before the worker enters its sandbox,
 * in which it sees its own folder alone. The next function reports files that are missing. */
void pipeline_link_geometry(const struct worker_folder *own, const char *geometry_job);
/* Links the checkpoints of the stages "volume" to "directions" of the job that the document names into the folder of
 * this job, and marks these stages as done; files that are there already stay. The folders of all jobs lie side by
 * side. Nothing happens when the document names no job (""). STATUS_INVALID, field OPTION_GEOMETRY_JOB: there is no
 * such job, its geometry is not done, or another version of the program made it. */
status pipeline_adopt_geometry(const struct stage_tools *tools, const char *geometry_job, struct error *err);

/* The error of a job that took over a geometry which cannot be read. */
status pipeline_geometry_lost(const char *geometry_job, const char *why, struct error *err);

#endif
