#include "renderer/transport/surface/path_tracer.h"

#include "renderer/transport/surface/path_plain.h"
#include "renderer/transport/surface/path_steps.h"

static void walk_start(struct walk *w, const struct path_setting *s, bool recorded, struct rng *rng,
                       struct path_result *out)
{
    size_t n_flat = s->want_jacobian ? 3 * s->n_set * s->model->n_param : 0;
    w->s = s;
    w->rng = rng;
    w->first_out = w->out = out;
    w->n_out = w->n_lamp > 0 ? w->n_lamp : 1;
    w->step = NULL;
    w->last = false;
    w->has_strips = s->has_strips && !recorded;
    w->state = s->state[0];
    w->i_set = 0;
    w->film = NULL;
    for (int c = 0; c < 3; c++) w->throughput[c] = 1;
    for (size_t k = 0; k < w->n_lamp; k++) w->weight[k] = 1;
    w->h = w->h_walk;
    memset(w->h, 0, n_flat * sizeof *w->h);
    for (size_t i = 0; i < w->n_out; i++) {
        memset(out[i].radiance, 0, sizeof out[i].radiance);
        memset(out[i].jac, 0, n_flat * sizeof *out[i].jac);
        out[i].n_bounce = 0;
    }
}

void path_trace(const struct path_setting *s, struct scene_ray *ray, struct rng *rng, struct path_result *out,
                struct path_record *record)
{
    struct walk w; /* large: only the members in use are set */
    w.lamp = &s->lights.lamp;
    w.n_lamp = s->lights.has_lamp;
    walk_start(&w, s, record != NULL, rng, out);
    if (s->plain && record == NULL)
        path_walk_plain(&w, ray);
    else
        walk_on(&w, ray, record);
}

void path_trace_lamps(const struct path_setting *s, const struct lamp *lamp, size_t n_lamp, struct scene_ray *ray,
                      struct rng *rng, struct path_result *out)
{
    struct walk w;
    w.lamp = lamp;
    w.n_lamp = n_lamp;
    walk_start(&w, s, false, rng, out);
    if (s->plain)
        path_walk_plain(&w, ray);
    else
        walk_on(&w, ray, NULL);
}
