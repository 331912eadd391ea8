/* The worker as one rank of several. Rank 0 runs the job as a single worker does, and shares its paths with the others;
 * they see neither the job's folder nor any other file. selvedge-mpi, which mpirun or srun starts, carries the messages
 * (selvedge_mpi_main.c). */
#ifndef SELVEDGE_OPTIMIZER_WORKER_TEAM_H
#define SELVEDGE_OPTIMIZER_WORKER_TEAM_H

#include "base/log.h"
#include "base/ranks/rank_team.h"
#include "renderer/estimate/shared_cloth.h"

/* The place of this process among the ranks, as selvedge-mpi gives it: "FD,RANK,RANKS", or "none". */
struct worker_team_place {
    bool given;
    int fd; /* -1: this worker is alone */
    size_t rank, n_rank;
};

struct worker_team {
    struct rank_team *team; /* NULL: this worker is alone */
    struct shared_cloth cloth;
};

bool worker_team_parse(const char *text, struct worker_team_place *place);
/* Returns whether mpirun or srun has started this process as one of several. */
bool worker_team_is_started(void);
/* Executes selvedge-mpi, which starts this program again with its place among the ranks. Returns only on failure:
 * STATUS_NOT_FOUND when it is not installed beside this program. */
status worker_team_join(char **argv, struct error *err);
/* Path of selvedge-mpi beside this program. STATUS_NOT_FOUND. */
status worker_team_program(char *path, size_t n_bytes, struct error *err);

/* Rank 0: joins the pool to the other ranks, and makes sure that they run the same program on like processors. Does
 * nothing for a worker that is alone. STATUS_INVALID, naming a rank; STATUS_IO. */
status worker_team_open(struct worker_team *t, const struct worker_team_place *place, struct thread_pool *pool,
                        struct error *err);
/* Ends the other ranks, takes the pool from them, and says in the log when one is lost. pool: NULL where there is
 * none. */
void worker_team_close(struct worker_team *t, struct thread_pool *pool, struct log *log);
/* At both ends of a stage: logs the traffic between the ranks. */
void worker_team_begin_stage(struct thread_pool *pool, struct rank_traffic *before);
void worker_team_end_stage(struct thread_pool *pool, const struct rank_traffic *before, const char *stage,
                           struct log *log);
/* Another rank is lost, so the job cannot go on in this process. */
bool worker_team_lost(const struct worker_team *t);
/* The other ranks: traces at the request of rank 0 until it ends. Returns the exit status. */
int worker_team_help(const struct worker_team_place *place, size_t n_thread);

#endif
