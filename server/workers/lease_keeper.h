/* The thread that keeps the lease of this daemon, where several daemons share the database, and takes over from daemons
 * that have ended: it removes their rows and ends their connections. Their jobs are queued again by the supervisor
 * (lease_keeper_adopt). A daemon that finds its own row gone has been taken over: it gets a new lease under a new id
 * and kills its workers, whose jobs other daemons have by then. Such a worker could not write any more, because the
 * token of its attempt differs from the token in the folder. While the server does not answer no lease ends: a daemon
 * ends other leases only when it has renewed its own for a whole lease without an error or a delay. */
#ifndef SELVEDGE_SERVER_LEASE_KEEPER_H
#define SELVEDGE_SERVER_LEASE_KEEPER_H

#include "server/jobs/job_service.h"

struct lease_keeper;

/* Begins the lease, and the thread. *keeper is NULL where the database is this daemon's alone. */
status lease_keeper_start(struct job_service *v, struct lease_keeper **keeper, struct error *err);
/* Ends the thread and gives the lease back. NULL is accepted. */
void lease_keeper_stop(struct lease_keeper *keeper);
/* How often the lease was lost; 0 for NULL. */
unsigned lease_keeper_losses(const struct lease_keeper *keeper);
/* Returns whether this daemon began before all others that live. It then does the work that a data folder needs
 * once. */
bool lease_keeper_is_eldest(struct job_service *v);
/* Queues the running jobs that no daemon holds; those whose end was asked for are cancelled. */
void lease_keeper_adopt(struct job_service *v);
/* "name boot-id pid-namespace" of this machine, as struct daemon_row has it. */
void lease_host_name(char *out, size_t n_out);

#endif
