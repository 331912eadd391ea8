/* Priors from another job: the parameters that it fitted to the profile of a single fiber become priors of this job. */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_PROFILE_PRIOR_H
#define SELVEDGE_OPTIMIZER_PIPELINE_PROFILE_PRIOR_H

#include "optimizer/stages/run/stage_tools.h"

struct job_cloth;
struct job_fit;

/* Copies result.json of the job that the document names to JOB/adopted/profile/, unless it is there: before the worker
 * enters its sandbox, in which it sees its own folder alone. The next function reports files that are missing. */
void pipeline_copy_profile(const struct worker_folder *own, const char *profile_job);
/* Adds priors to the models of the document. A parameter takes the value and the standard error of the parameter of the
 * same name, in each set of a cloth of several groups, unless it is fixed or tied or has a prior here, or was fixed,
 * undetermined or at its bound there. Nothing happens when the document names no job, or when the lock of the folder is
 * not held. STATUS_INVALID, field OPTION_PROFILE_JOB: there is no such job, it has no profile or is not done, or has
 * none of this job's models. */
status pipeline_profile_priors(const struct stage_tools *tools, const struct job_cloth *cloth, struct job_fit *fit,
                               struct error *err);

#endif
