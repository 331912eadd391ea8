/* Two ranks in a test: a root in this process and a helper in another one, joined by a socket as selvedge-mpi joins
 * them by MPI. */
#ifndef SELVEDGE_TESTS_TWO_RANKS_H
#define SELVEDGE_TESTS_TWO_RANKS_H

#include "base/ranks/rank_team.h"
#include "renderer/estimate/shared_cloth.h"

#include <sys/types.h>

struct two_ranks {
    struct rank_team *team;
    struct thread_pool *pool; /* joined to the team; n_thread threads, as the helper's */
    struct shared_cloth cloth;
    pid_t helper; /* runs the program "the test" (rank_helper.h) */
};

/* Failures end the test. */
void two_ranks_start(struct two_ranks *r, size_t n_thread);
/* Returns how the helper has ended, as waitpid does. */
int two_ranks_end(struct two_ranks *r);

#endif
