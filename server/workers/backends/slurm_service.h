/* The thread of the backend `slurm` that talks to Slurm: it submits, looks at the list of jobs, and cancels. The
 * supervisor's thread only changes the requests to the runs, under the lock. */
#ifndef SELVEDGE_SERVER_SLURM_SERVICE_H
#define SELVEDGE_SERVER_SLURM_SERVICE_H

#include "server/files/backend_note.h"
#include "server/settings/job_paths.h"
#include "server/workers/backends/slurm_text.h"

#include <pthread.h>
#include <stdatomic.h>

enum slurm_step {
    SLURM_TO_SUBMIT,
    SLURM_TO_FIND, /* it may have been submitted, under a number that is not known */
    SLURM_KNOWN,   /* note.id is its number */
    SLURM_OVER
};

/* All members are guarded by the lock, except those that only the thread of this service uses. */
struct backend_run {
    struct backend_run *next;
    char job_id[STORE_ID_BYTES], comment[SLURM_COMMENT_BYTES];
    int64_t attempt;
    enum slurm_step step;
    bool released;      /* the supervisor has forgotten it */
    bool stop, at_once; /* requests of the supervisor */
    enum backend_phase phase;
    struct worker_end end; /* with BACKEND_ENDED */
    /* of the thread of this service */
    struct backend_note note;
    double stop_sent_s; /* when it was cancelled last; 0: not yet */
    double gone_s;      /* since when it is listed no longer, or its last files are awaited; 0: neither */
};

struct slurm_service {
    struct job_service *v;
    const char *program;
    char sbatch[PATH_BYTES], squeue[PATH_BYTES], scancel[PATH_BYTES], sacct[PATH_BYTES]; /* sacct "": no accounts */
    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t changed;
    atomic_bool stop;
    struct backend_run *first;
    char trouble[SLURM_ERROR_BYTES]; /* why Slurm takes no jobs; "": it does */
    bool full;                       /* the trouble is a limit of Slurm's alone: its list of jobs can be read */
    bool one_by_one;                 /* a limit was met once: a job starts when the one before it is submitted */
    double not_before_s, pause_s;    /* no submission before; the last pause between two tries */
    double looked_s;                 /* when the list was read last */
};

/* The work of the thread. All functions are called without the lock, for runs that only this thread removes. */
/* Submits the job, or finds out why that is not possible. */
void slurm_submit(struct slurm_service *d, struct backend_run *run);
/* Reads Slurm's list of jobs and updates all runs. */
void slurm_look(struct slurm_service *d);
void slurm_cancel(struct slurm_service *d, struct backend_run *run);

/* Notes that Slurm cannot be used, in its own words, and for how long nothing is to be submitted. full: because of a
 * limit of Slurm's. */
void slurm_note_trouble(struct slurm_service *d, const char *command, const char *words, bool full);
/* Ends a run and writes its note. */
void slurm_conclude(struct slurm_service *d, struct backend_run *run, const struct worker_end *end);

#endif
