#include "renderer/transport/volume/volume_tracer.h"

struct replay {
    const struct volume_parameters *now, *then;
    double ratio_d; /* density multiplier over the multiplier of tracing */
    double majorant_density;
};

/* Extinction at a look-up over the majorant of tracing. */
static double majorant_share(const struct replay *r, const struct volume_parameters *p, const struct volume_event *e)
{
    float unused;
    double s = (double)phase_extinction_at(p->model->extinction(p->state), e->sine, &unused);
    return (p == r->now ? r->ratio_d : 1) * (double)e->density * s / r->majorant_density;
}

/* Factor of an event that changes the throughput or the light on its way, the same for all channels. */
static double event_factor(const struct replay *r, const struct volume_event *e)
{
    switch (e->kind) {
    case VOLUME_NULL:
        return (1 - majorant_share(r, r->now, e)) / (1 - majorant_share(r, r->then, e));
    case VOLUME_REAL:
        return majorant_share(r, r->now, e) / majorant_share(r, r->then, e);
    case VOLUME_PASSED:
        return 1 - majorant_share(r, r->now, e);
    default:
        return 1;
    }
}

double volume_replay(const struct volume_scene *scene, const struct volume_parameters *now,
                     const struct volume_parameters *then, const struct volume_record *record)
{
    const struct replay r = {.now = now,
                             .then = then,
                             .ratio_d = now->multiplier_per_m / then->multiplier_per_m,
                             .majorant_density = (double)volume_majorant_density(scene, then)};
    double t[3] = {1, 1, 1}, light[3] = {0}, sum = 0;
    for (size_t i = 0; i < record->n_event; i++) {
        const struct volume_event *e = &record->event[i];
        float f[3] = {0, 0, 0};
        double factor = event_factor(&r, e);
        if (e->kind == VOLUME_SCATTER || e->kind == VOLUME_CONNECT)
            (void)now->model->eval_pdf(now->state, e->wi, e->wo, NULL, f, NULL);
        for (int c = 0; c < 3; c++) {
            if (e->kind == VOLUME_NULL || e->kind == VOLUME_REAL) t[c] *= factor;
            if (e->kind == VOLUME_SCATTER) t[c] *= (double)f[c] * (double)e->weight[0];
            if (e->kind == VOLUME_CONNECT) light[c] = t[c] * (double)f[c] * (double)e->weight[c];
            if (e->kind == VOLUME_PASSED) light[c] *= factor;
            if (e->kind == VOLUME_ARRIVE) sum += light[c] * (double)e->weight[0];
            if (e->kind == VOLUME_BEYOND) sum += t[c] * (double)e->weight[c];
        }
    }
    return sum;
}
