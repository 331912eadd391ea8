/* A job that goes on from the geometry of another one: the checkpoints of that job become its own. */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_ADOPT_H
#define SELVEDGE_OPTIMIZER_PIPELINE_ADOPT_H

#include "optimizer/worker/pipeline_context.h"

/* Writes the path of another job's folder, which lies beside this one's. false: it is too long. */
bool pipeline_other_folder(const struct worker_folder *own, const char *job, struct worker_folder *other);
/* Links what the next function needs of the other job to JOB/adopted/: before the worker enters its sandbox, in which
 * it sees its own folder alone. What is missing is reported by the next function. */
void pipeline_link_geometry(const struct worker_folder *own, const struct job_document *doc);
/* Links the checkpoints of the stages "volume" to "directions" of the job that the document names into the folder of
 * this job, and marks these stages as done; what is there already stays. The folders of all jobs lie side by side.
 * Nothing happens when the document names no job. STATUS_INVALID, field OPTION_GEOMETRY_JOB: there is no such job, its
 * geometry is not done, or another version of the program made it. */
status pipeline_adopt_geometry(struct pipeline_context *c, struct error *err);

#endif
