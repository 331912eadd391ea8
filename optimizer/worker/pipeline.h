/* Runs the stages of a job in the order of the stage table (optimizer/job/stage_table.h), and loads those that an
 * earlier attempt has finished. */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_H
#define SELVEDGE_OPTIMIZER_PIPELINE_H

#include "optimizer/report/findings/report.h"
#include "optimizer/stages/job_inputs.h"
#include "optimizer/worker/pipeline_plan.h"

struct pipeline_option {
    size_t most_scratch_bytes; /* bound on the files of large arrays; 0: the free disk is */
    struct program_helpers helper;
    bool pictures; /* all stages but the last are loaded, and pictures are made in place of the report; STATUS_NOT_FOUND
                      where a stage has no output */
};

/* tools: folder, status, log, pool and memory limit; the others are set here. plan: of these tools and inputs. Errors
 * of the stages; err->field is a key of the job document. */
status pipeline_run(struct stage_tools *tools, const struct job_inputs *inputs, const struct pipeline_option *option,
                    struct job_plan *plan, struct error *err);

#endif
