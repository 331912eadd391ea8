#include "optimizer/fit/descent/trace_estimator.h"

#include "base/clock.h"

#include <stdlib.h>

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
    status s = estimate_run(&q, t->pool, progress, out, err);
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
