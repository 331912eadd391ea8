/* Runs a job with several ranks on this machine, or on those that mpirun knows of: starts mpirun, passes signals on,
 * and starts it again when a rank is lost, so that the job goes on from its checkpoint. */
#ifndef SELVEDGE_OPTIMIZER_WORKER_LAUNCHER_H
#define SELVEDGE_OPTIMIZER_WORKER_LAUNCHER_H

#include <stddef.h>

/* Makes this process a rank of several, or their launcher, where that is wanted: when mpirun or srun has started it as
 * one of several, or when n_rank is above 1. argv: the program's own arguments; the ranks get them without "--ranks N".
 * n_thread 0: the processors of this machine are divided among the ranks. Returns -1 to go on alone, otherwise the exit
 * status: rank 0's, WORKER_LOST after three losses in a row without progress of the job, WORKER_CANCELLED when the job
 * was stopped before rank 0 had begun it, WORKER_USAGE without MPI. Ends the process by SIGSYS when the sandbox of a
 * rank has ended that rank so. */
int worker_ranks_start(char **argv, const char *job_folder, size_t n_rank, size_t n_thread);

#endif
