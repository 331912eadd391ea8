/* The request of a job to Slurm: the command line of sbatch and the script that it submits. */
#ifndef SELVEDGE_SERVER_SLURM_REQUEST_H
#define SELVEDGE_SERVER_SLURM_REQUEST_H

#include "server/settings/job_paths.h"
#include "server/workers/backends/slurm_text.h"

/* The needs of one start of a job. */
struct slurm_need {
    int64_t cores, memory_bytes;
};

/* A job's memory besides its files; 0: not known. */
struct slurm_memory {
    int64_t planned_bytes; /* by the job's plan (server/workers/input_judge.h) */
    int64_t least_bytes;   /* twice the memory that was too little for an earlier attempt */
};

/* The need of a job by its input files (docs/cluster.md states the rule). */
struct slurm_need slurm_need_of(const struct settings *settings, const struct file_row *file, size_t n_file,
                                struct slurm_memory known);

/* Checks the settings of [slurm] that Slurm itself does not check at the start. STATUS_INVALID names the setting. */
status slurm_request_check(const struct settings *settings, struct error *err);

/* One submission. */
struct slurm_submission {
    const char *sbatch, *program; /* paths of sbatch and of the worker */
    const struct job_row *row;    /* as attempt_prepare has left it */
    struct slurm_need need;
};

enum { SLURM_MAX_ARGUMENT = 64, SLURM_ARGUMENT_BYTES = 4096 };

/* The arguments of sbatch, and the script that it reads. */
struct slurm_request {
    const char *argument[SLURM_MAX_ARGUMENT + 1]; /* NULL after the last */
    char text[4 * PATH_BYTES + SETTING_TEXT_BYTES + SLURM_ARGUMENT_BYTES];
    char script[4 * PATH_BYTES + SLURM_ARGUMENT_BYTES];
};

/* STATUS_INVALID when a path is too long. */
status slurm_request_make(const struct settings *settings, const struct slurm_submission *submission,
                          struct slurm_request *request, struct error *err);

/* The comment by which a job is found in Slurm: "selvedge:ID:ATTEMPT". */
void slurm_comment(const char *job_id, int64_t attempt, char comment[SLURM_COMMENT_BYTES]);

#endif
