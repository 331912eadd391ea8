#include "server/cluster/job_change.h"
#include "server/store/store_cluster.h"

void job_change_begin(struct job_service *v, const char *job_id, const char *owner)
{
    pthread_mutex_lock(&v->change);
    store_gate_enter(v->store, job_id, owner);
}

void job_change_end(struct job_service *v)
{
    store_gate_leave(v->store);
    pthread_mutex_unlock(&v->change);
}
