#include "optimizer/fit/descent/trace_estimator.h"

#include "base/clock.h"

#include <stdlib.h>

static status trace(void *context, const struct estimator_call *call, const struct progress *progress,
                    struct estimate *out, double *wall_s, struct error *err)
{
    const struct trace_estimator *t = context;
    const struct appearance_request q = {.scene = t->scene,
                                         .model = t->model,
                                         .param = call->param,
                                         .configuration = t->configuration,
                                         .n_configuration = t->n_configuration,
                                         .n_path = call->n_path,
                                         .seed = t->seed,
                                         .iteration = call->iteration,
                                         .replica = call->replica,
                                         .want_jacobian = call->want_jacobian,
                                         .no_probes = call->plain_paths};
    double start_s = clock_monotonic_s();
    status s = appearance_estimate_run(&q, t->pool, progress, out, err);
    *wall_s = clock_monotonic_s() - start_s;
    return s;
}

struct estimator trace_estimator(struct trace_estimator *t)
{
    return (struct estimator){
        .context = t, .n_configuration = t->n_configuration, .n_param = t->model->n_param, .run = trace};
}

struct configuration *trace_configurations(const struct observation_set *o)
{
    struct configuration *c = malloc((o->n > 0 ? o->n : 1) * sizeof *c);
    for (size_t i = 0; c != NULL && i < o->n; i++) c[i] = o->item[i].configuration;
    return c;
}
