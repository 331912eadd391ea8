/* The tools that the worker lends to every stage of a job: the job's folder, status, log, threads, disk for large
 * arrays, and the progress of the running stage. */
#ifndef SELVEDGE_OPTIMIZER_STAGE_TOOLS_H
#define SELVEDGE_OPTIMIZER_STAGE_TOOLS_H

#include "base/files/scratch_space.h"
#include "base/log.h"
#include "base/progress.h"
#include "base/thread_pool.h"
#include "base/warning.h"
#include "optimizer/stages/run/worker_folder.h"
#include "optimizer/stages/run/worker_status.h"

/* Functions by which a stage reports news about the work that is left. Either may be called at any time. */
struct stage_plan {
    void *context;
    /* The scan of n voxels has hollow fibers, which are traced to fill their lumens. */
    void (*hollow)(void *context, const size_t n[3]);
    void (*fit_paths)(void *context, double n_path); /* the fits have traced n_path paths at this fraction */
};

/* Nothing is owned. */
struct stage_tools {
    const struct worker_folder *folder;
    struct worker_status *status;
    struct log *log;
    struct thread_pool *pool;
    struct scratch_space *space; /* of volumes: JOB/work beyond the memory limit; NULL without a limit */
    size_t memory_limit_bytes;   /* of the geometry stages; 0: none */
    uint64_t fingerprint;        /* of the job document's text and this build of the program */
    struct progress progress;    /* of the running stage */
    struct warning_sink warn;    /* stage_warn with these tools */
    struct stage_plan plan;      /* functions NULL: the plan is not told */
};

/* Adds a warning to the job's status, with the key of the option that it is about (base/option_id.h). context: a struct
 * stage_tools. A receiver for base/warning.h. */
void stage_warn(void *context, const char *option, const char *text);
/* Writes the path of a stage's checkpoint, JOB/work/<stage>/<name>, and makes its folder. */
status stage_work_path(const struct stage_tools *tools, const char *stage, const char *name,
                       char path[WORKER_PATH_BYTES], struct error *err);
/* The same with a number in the name for all models but the first: "estimates.journal", "estimates-1.journal". */
status stage_model_path(const struct stage_tools *tools, const char *stage, const char *name, size_t i_model,
                        char path[WORKER_PATH_BYTES], struct error *err);

#endif
