#include "server/jobs/job_change.h"
#include "server/store/store_cluster.h"

void job_change_begin(struct job_service *v, const char *job_id, const char *owner)
{
    struct job_turns *t = &v->change;
    pthread_mutex_lock(&t->lock);
    uint64_t turn = t->n_asked++;
    while (t->n_served != turn) pthread_cond_wait(&t->next_turn, &t->lock);
    pthread_mutex_unlock(&t->lock);
    store_gate_enter(v->store, job_id, owner);
}

void job_change_end(struct job_service *v)
{
    store_gate_leave(v->store);
    struct job_turns *t = &v->change;
    pthread_mutex_lock(&t->lock);
    t->n_served++;
    pthread_cond_broadcast(&t->next_turn);
    pthread_mutex_unlock(&t->lock);
}
