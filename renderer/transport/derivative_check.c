#include "renderer/transport/derivative_check.h"

#include "renderer/transport/camera.h"
#include "renderer/transport/estimate_blocks.h"
#include "renderer/transport/surface/path_tracer.h"
#include "renderer/transport/volume/volume_tracer.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N_POINT = 4, MAX_STEP = 32768, MAX_STEP_CONFIGURATION = 4096 };

/* Relative step: rounding of a path's float factors (1e-6) stays below 1e-3 of the difference. */
static const double relative_step = 2e-3;
/* Least scale of a step, of the parameter's range. A small colour counts as 1 - C too, which single precision rounds to
 * 3e-8 whatever C is: steps by C alone made 5 % of that beside the bound 0.001. Above 0.1 the stencil's own error shows
 * in black cloth. */
static const double least_scale = 1e-3, least_scale_of_colour = 0.1;

/* Values at offset[k] h give the derivative sum coefficient[k] f / h. */
struct stencil {
    double offset[N_POINT], coefficient[N_POINT];
};
static const struct stencil middle = {{-2, -1, 1, 2}, {1 / 12.0, -8 / 12.0, 8 / 12.0, -1 / 12.0}},
                            upwards = {{0, 1, 2, 3}, {-11 / 6.0, 18 / 6.0, -9 / 6.0, 2 / 6.0}},
                            downwards = {{0, -1, -2, -3}, {11 / 6.0, -18 / 6.0, 9 / 6.0, -2 / 6.0}};

/* The model at one moved point. */
struct point {
    struct scattering_state *surface;
    struct phase_state *volume;
    double ratio_d; /* density multiplier over that of tracing */
};

struct check {
    const struct derivative_check_request *q;
    struct derivative_check *out;
    struct point here, *point; /* n_param x N_POINT */
    double h[SCATTERING_MAX_PARAM];
    const struct stencil *stencil[SCATTERING_MAX_PARAM];
    struct path_step *step;     /* of one path */
    struct volume_event *event; /* likewise */
    float majorant_density;
    /* of one configuration: sums over paths of the channels' sum */
    double radiance, jac[SCATTERING_MAX_PARAM], miss[SCATTERING_MAX_PARAM], miss2[SCATTERING_MAX_PARAM];
    /* over configurations */
    double total, slope[SCATTERING_MAX_PARAM], error[SCATTERING_MAX_PARAM], var[SCATTERING_MAX_PARAM];
};

/* ---- the model at moved parameters ---- */

static status point_init(struct point *p, const struct derivative_check_request *q, const double *param,
                         struct error *err)
{
    if (q->model->kind == APPEARANCE_SURFACE) return q->model->surface->prepare(param, &p->surface, err);
    p->ratio_d = param[q->model->n_param - 1] / q->param[q->model->n_param - 1];
    return q->model->volume->prepare(param, &p->volume, err);
}

static void point_release(struct point *p, const struct appearance *m)
{
    if (p->surface != NULL) m->surface->release(p->surface);
    if (p->volume != NULL) m->volume->release(p->volume);
}

static status prepare_points(struct check *k, struct error *err)
{
    const struct derivative_check_request *q = k->q;
    status s = point_init(&k->here, q, q->param, err);
    for (size_t p = 0; p < q->model->n_param && s == STATUS_OK; p++) {
        const struct param_info *info = &q->model->param[p];
        double moved[SCATTERING_MAX_PARAM], v = q->param[p];
        double least = info->channel >= 0 ? least_scale_of_colour : least_scale;
        k->h[p] = relative_step * fmax(fabs(v), least * (info->upper - info->lower));
        k->stencil[p] = v - 2.0 * k->h[p] < info->lower   ? &upwards
                        : v + 2.0 * k->h[p] > info->upper ? &downwards
                                                          : &middle;
        if (q->skip != NULL && q->skip[p]) continue;
        k->out->checked[p] = true;
        memcpy(moved, q->param, q->model->n_param * sizeof *moved);
        for (size_t i = 0; i < N_POINT && s == STATUS_OK; i++) {
            moved[p] = v + k->stencil[p]->offset[i] * k->h[p];
            s = point_init(&k->point[p * N_POINT + i], q, moved, err);
        }
    }
    return s;
}

/* ---- a recorded path at another point: sum over channels of its radiance ---- */

static double surface_value(const struct check *k, const struct point *p, const struct path_record *record)
{
    const struct scattering_model *m = k->q->model->surface;
    double t[3] = {1, 1, 1}, sum = 0;
    for (size_t i = 0; i < record->n_step; i++) {
        const struct path_step *s = &record->step[i];
        float rgb[3];
        if (s->light > 0) {
            m->eval(p->surface, s->light_wi, s->wo, rgb, NULL);
            for (int c = 0; c < 3; c++) sum += t[c] * (double)rgb[c] * (double)s->light;
        }
        if (s->image[0] + s->image[1] + s->image[2] > 0) {
            m->eval(p->surface, s->image_wi, s->wo, rgb, NULL);
            for (int c = 0; c < 3; c++) sum += t[c] * (double)rgb[c] * (double)s->image[c];
        }
        if (s->probe_light > 0) {
            float ahead[3];
            m->eval(p->surface, s->probe_wi, s->wo, rgb, NULL);
            m->eval(p->surface, s->probe_light_wi, s->probe_wo, ahead, NULL);
            for (int c = 0; c < 3; c++) sum += t[c] * (double)rgb[c] * (double)ahead[c] * (double)s->probe_light;
        }
        if (s->weight <= 0) continue; /* the path ended here */
        m->eval(p->surface, s->wi, s->wo, rgb, NULL);
        for (int c = 0; c < 3; c++) {
            t[c] *= (double)rgb[c] * (double)s->weight;
            sum += t[c] * (double)s->escape[c];
        }
    }
    return sum;
}

static double share_of_majorant(const struct check *k, const struct point *p, const struct volume_event *e)
{
    const struct phase_model *m = k->q->model->volume;
    float unused;
    double s = (double)phase_extinction_at(m->extinction(p->volume), e->sine, &unused);
    return p->ratio_d * (double)e->density * s / (double)k->majorant_density;
}

static double volume_value(const struct check *k, const struct point *p, const struct volume_record *record)
{
    const struct phase_model *m = k->q->model->volume;
    double t[3] = {1, 1, 1}, light[3] = {0}, sum = 0;
    for (size_t i = 0; i < record->n_event; i++) {
        const struct volume_event *e = &record->event[i];
        float f[3] = {0, 0, 0};
        double factor = 1;
        switch (e->kind) {
        case VOLUME_NULL:
            factor = (1 - share_of_majorant(k, p, e)) / (1 - share_of_majorant(k, &k->here, e));
            break;
        case VOLUME_REAL:
            factor = share_of_majorant(k, p, e) / share_of_majorant(k, &k->here, e);
            break;
        case VOLUME_SCATTER:
        case VOLUME_CONNECT:
            (void)m->eval_pdf(p->volume, e->wi, e->wo, NULL, f, NULL);
            break;
        case VOLUME_PASSED:
            factor = 1 - share_of_majorant(k, p, e);
            break;
        default:
            break;
        }
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

/* ---- paths ---- */

/* Adds one path; value: of its record at a point. */
static status add_path(struct check *k, const float radiance[3], const float *jac,
                       double (*value)(const struct check *k, const struct point *p, const void *record),
                       const void *record, struct error *err)
{
    size_t n = k->q->model->n_param;
    for (int c = 0; c < 3; c++) k->radiance += (double)radiance[c];
    for (size_t p = 0; p < n; p++) {
        if (!k->out->checked[p]) continue;
        double own = 0, difference = 0;
        for (size_t c = 0; c < 3; c++) own += (double)jac[c * n + p];
        for (size_t i = 0; i < N_POINT; i++)
            difference += k->stencil[p]->coefficient[i] * value(k, &k->point[p * N_POINT + i], record) / k->h[p];
        if (!isfinite(own) || !isfinite(difference))
            return error_set_field(err, STATUS_NUMERIC, k->q->model->param[p].name,
                                   "model '%s' gave a value that is not finite (parameter '%s')", k->q->model->id,
                                   k->q->model->param[p].name);
        k->jac[p] += own;
        k->miss[p] += own - difference;
        k->miss2[p] += (own - difference) * (own - difference);
    }
    return STATUS_OK;
}

static double value_of_surface(const struct check *k, const struct point *p, const void *record)
{
    return surface_value(k, p, record);
}

static double value_of_volume(const struct check *k, const struct point *p, const void *record)
{
    return volume_value(k, p, record);
}

static status trace_surface(struct check *k, const struct path_setting *setting, const struct camera *camera, double x,
                            double y, struct rng *rng, size_t *n_step, struct error *err)
{
    struct path_result path;
    struct scene_ray ray;
    struct path_record record = {0, MAX_STEP, k->step};
    if (!camera_ray(camera, k->q->scene.fibers, x, y, &ray)) return STATUS_OK;
    path_trace(setting, &ray, rng, &path, &record);
    *n_step = record.n_step;
    return record.n_step <= record.capacity ? add_path(k, path.radiance, path.jac, value_of_surface, &record, err)
                                            : STATUS_OK;
}

static status trace_volume(struct check *k, const struct volume_setting *setting, const struct camera *camera, double x,
                           double y, struct rng *rng, size_t *n_step, struct error *err)
{
    struct volume_result path;
    struct volume_ray ray;
    struct volume_record record = {0, MAX_STEP, k->event};
    double origin_mm[3], direction[3];
    camera_origin(camera, x, y, origin_mm);
    camera_direction(camera, x, y, direction);
    if (!volume_ray_enter(k->q->scene.volume, origin_mm, direction, &ray)) return STATUS_OK;
    volume_trace(setting, &ray, rng, &path, &record);
    *n_step = record.n_event / 4; /* look-ups are cheap beside scattering */
    return record.n_event <= record.capacity ? add_path(k, path.radiance, path.jac, value_of_volume, &record, err)
                                             : STATUS_OK;
}

static status check_configuration(struct check *k, size_t i, size_t n_path, struct error *err)
{
    const struct derivative_check_request *q = k->q;
    struct path_setting surface;
    struct volume_setting volume;
    struct camera camera;
    camera_init(&camera, &q->configuration[i]);
    if (q->model->kind == APPEARANCE_SURFACE) {
        path_setting_init(&surface, q->scene.fibers, q->model->surface, k->here.surface, &q->configuration[i], true);
    } else {
        volume_setting_init(&volume, q->scene.volume, q->model->volume, k->here.volume, q->param[q->model->n_param - 1],
                            &q->configuration[i], true);
        k->majorant_density = volume.majorant_density;
    }
    k->radiance = 0;
    memset(k->jac, 0, sizeof k->jac);
    memset(k->miss, 0, sizeof k->miss);
    memset(k->miss2, 0, sizeof k->miss2);
    size_t n_done = 0, n_step_all = 0;
    for (; n_done < n_path && n_step_all < MAX_STEP_CONFIGURATION; n_done++) {
        struct rng rng;
        size_t n_step = 0;
        rng_start(&rng, &(struct rng_key){q->seed, q->iteration, q->replica, (uint32_t)i}, (uint32_t)n_done, 0);
        double x = rng_double(&rng), y = rng_double(&rng);
        status s = q->model->kind == APPEARANCE_SURFACE ? trace_surface(k, &surface, &camera, x, y, &rng, &n_step, err)
                                                        : trace_volume(k, &volume, &camera, x, y, &rng, &n_step, err);
        if (s != STATUS_OK) return s;
        n_step_all += n_step;
    }
    double n = (double)n_done, weight = (q->weight != NULL ? q->weight[i] : 1.0) / n;
    k->total += weight * k->radiance;
    for (size_t p = 0; p < q->model->n_param; p++) {
        k->slope[p] += weight * fabs(k->jac[p]);
        k->error[p] += weight * fabs(k->miss[p]);
        k->var[p] += weight * weight * fmax(0.0, k->miss2[p] - k->miss[p] * k->miss[p] / n);
    }
    k->out->n_path += n_done;
    k->out->n_step += n_step_all;
    return STATUS_OK;
}

static void judge(struct check *k)
{
    const struct derivative_check_request *q = k->q;
    for (size_t p = 0; p < q->model->n_param; p++) {
        if (!k->out->checked[p]) continue;
        double scale = fmax(k->slope[p], 1e-3 * k->total / fmax(fabs(q->param[p]), k->h[p]));
        if (!(scale > 0.0)) continue; /* a cloth that shows nothing */
        k->out->error[p] = k->error[p] / scale;
        k->out->error_se[p] = sqrt(k->var[p]) / scale;
        if (k->out->error[p] > k->out->error[k->out->worst]) k->out->worst = p;
    }
}

status derivative_check_run(const struct derivative_check_request *q, const struct progress *progress,
                            struct derivative_check *out, struct error *err)
{
    bool surface = q->model->kind == APPEARANCE_SURFACE;
    memset(out, 0, sizeof *out);
    out->n_param = q->model->n_param;
    status s = appearance_scene_check(&q->scene, q->model, "check", err);
    if (s == STATUS_OK)
        s = estimate_check_configurations(q->configuration, q->n_configuration, q->iteration, q->replica, err);
    if (s != STATUS_OK) return s;
    struct check *k = calloc(1, sizeof *k);
    size_t n = q->model->n_param, n_path = q->n_path / (q->n_configuration > 0 ? q->n_configuration : 1);
    if (k != NULL) {
        k->q = q;
        k->out = out;
        k->point = calloc(n * N_POINT, sizeof *k->point);
        k->step = surface ? calloc(MAX_STEP, sizeof *k->step) : NULL;
        k->event = surface ? NULL : calloc(MAX_STEP, sizeof *k->event);
    }
    if (k == NULL || k->point == NULL || (surface ? k->step == NULL : k->event == NULL)) {
        s = error_set(err, STATUS_NO_MEMORY, "cannot check derivatives: out of memory");
        goto out;
    }
    s = prepare_points(k, err);
    for (size_t i = 0; i < q->n_configuration && s == STATUS_OK; i++) {
        if (progress_cancelled(progress))
            s = error_set(err, STATUS_CANCELLED, "cancelled");
        else
            s = check_configuration(k, i, n_path > 0 ? n_path : 1, err);
    }
    if (s == STATUS_OK) judge(k);
out:
    for (size_t i = 0; k != NULL && k->point != NULL && i < n * N_POINT; i++) point_release(&k->point[i], q->model);
    if (k != NULL) {
        point_release(&k->here, q->model);
        free(k->point);
        free(k->step);
        free(k->event);
    }
    free(k);
    return s;
}
