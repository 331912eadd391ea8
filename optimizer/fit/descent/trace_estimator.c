#include "optimizer/fit/descent/trace_estimator.h"

#include "base/clock.h"

#include "renderer/estimate/rotation_mean.h"

#include <stdlib.h>
#include <string.h>

static bool is_ready(const struct estimator_call *call, const struct estimate *out)
{
    const struct estimator_pair *p = call->pair;
    return p != NULL && p->ready && p->next == out && p->iteration == call->iteration && p->replica == call->replica;
}

/* Both replicas at once. */
static status trace_pair(struct estimate_request *q, struct thread_pool *pool, struct estimator_pair *pair,
                         const struct progress *progress, struct estimate *out, struct error *err)
{
    const size_t n = q->n_configuration;
    struct estimate *both = calloc(2 * n, sizeof *both);
    if (both == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot estimate radiance: out of memory");
    q->next_replica_too = true;
    pair->ready = false;
    status s = estimate_run(q, pool, progress, both, err);
    if (s == STATUS_OK) {
        memcpy(out, both, n * sizeof *both);
        memcpy(pair->next, both + n, n * sizeof *both);
        *pair = (struct estimator_pair){pair->next, true, q->iteration, q->replica + 1};
    }
    free(both);
    return s;
}

static status trace(void *context, const struct estimator_call *call, const struct progress *progress,
                    struct estimate *out, double *wall_s, struct error *err)
{
    const struct trace_estimator *t = context;
    struct estimate_request q = t->request;
    q.input.param = call->param;
    q.input.want_derivative = call->want_jacobian;
    q.input.plain_paths = call->plain_paths;
    q.n_path = call->n_path;
    q.iteration = call->iteration;
    q.replica = call->replica;
    double start_s = clock_monotonic_s();
    *wall_s = 0.0;
    if (is_ready(call, out)) return STATUS_OK;
    const bool both = call->pair != NULL && call->replica == REPLICA_FIT_A && thread_pool_team(t->pool) != NULL &&
                      !rotation_mean_wanted(q.configuration, q.n_configuration);
    status s =
        both ? trace_pair(&q, t->pool, call->pair, progress, out, err) : estimate_run(&q, t->pool, progress, out, err);
    *wall_s = clock_monotonic_s() - start_s;
    return s;
}

struct estimator trace_estimator(struct trace_estimator *t)
{
    const struct radiance_input *in = &t->request.input;
    return (struct estimator){.context = t,
                              .n_configuration = t->request.n_configuration,
                              .n_param = (in->n_set > 1 ? in->n_set : 1) * in->model->n_param,
                              .run = trace};
}

struct configuration *trace_configurations(const struct observation_set *o)
{
    struct configuration *c = malloc((o->n > 0 ? o->n : 1) * sizeof *c);
    for (size_t i = 0; c != NULL && i < o->n; i++) c[i] = o->item[i].configuration;
    return c;
}
