/* The output of Slurm's commands: ids, lists of jobs, reasons for a refusal. The one table of the states of Slurm's
 * jobs, and of the phases that they are for this service. */
#ifndef SELVEDGE_SERVER_SLURM_TEXT_H
#define SELVEDGE_SERVER_SLURM_TEXT_H

#include "server/workers/backends/job_backend.h"
#include "server/workers/backends/slurm_command.h"

enum { SLURM_ID_BYTES = 24, SLURM_STATE_BYTES = 24, SLURM_REASON_BYTES = 80, SLURM_COMMENT_BYTES = 80 };

/* The columns of squeue that slurm_parse_jobs reads (squeue --Format). */
#define SLURM_COLUMNS "JobID:|,State:|,exit_code:|,Reason:|,NodeList:|,Comment:|"
/* The columns of sacct that slurm_parse_account reads (sacct --parsable2 --format). */
#define SLURM_ACCOUNT_COLUMNS "JobIDRaw,State,ExitCode,NodeList"

struct slurm_job {
    char id[SLURM_ID_BYTES], state[SLURM_STATE_BYTES], reason[SLURM_REASON_BYTES], nodes[SLURM_REASON_BYTES],
        comment[SLURM_COMMENT_BYTES];
    int wait_status; /* as waitpid gives it for the batch script */
};

/* Reads the output of "sbatch --parsable": "123" or "123;cluster". Returns false for anything else. */
bool slurm_parse_id(const char *text, char id[SLURM_ID_BYTES]);
/* Reads lines of SLURM_COLUMNS; a line that has other columns is passed over. *job, an array of *n, is owned by the
 * caller. STATUS_NO_MEMORY. */
status slurm_parse_jobs(const char *text, struct slurm_job **job, size_t *n, struct error *err);
/* Reads the line of this id from lines with SLURM_ACCOUNT_COLUMNS. Returns false when there is none, or when the job
 * has not ended by it: the accounts of a job that Slurm lists no longer may say for ever that it runs. */
bool slurm_parse_account(const char *text, const char *id, struct slurm_job *job);

enum slurm_failure {
    SLURM_REFUSED,  /* the job or the settings are at fault: the same request would fail again */
    SLURM_AWAY,     /* Slurm cannot be reached; the request had no effect */
    SLURM_FULL,     /* a limit of Slurm's is reached, such as the number of a user's jobs; the request had no effect */
    SLURM_UNCERTAIN /* the request may have had its effect, although no answer came */
};
/* The meaning of an error message of a command. */
enum slurm_failure slurm_failure_of(const struct slurm_output *output);

/* The phase of a job, and how it ended. ranks: whether srun starts the worker, whose exit code is then srun's. */
enum backend_phase slurm_phase_of(const struct slurm_job *job, bool ranks, struct worker_end *end);

#endif
