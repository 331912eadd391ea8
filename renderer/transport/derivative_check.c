#include "renderer/transport/derivative_check.h"

#include "renderer/transport/estimate/estimate_blocks.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N_POINT = 4, MAX_ENTRY = 32768, MAX_BOUNCE_CONFIGURATION = 4096, N_VALUE = 3 + 3 * SCATTERING_MAX_FLAT };

/* Relative step. With it, rounding of the float factors of a path (1e-6) stays below 1e-3 of the difference. */
static const double relative_step = 2e-3;
/* Least scale of a step, relative to the range of the parameter. Models also use 1 - C, which single precision rounds
 * to 3e-8 however small the colour C is: with steps proportional to C alone the error was 5 % at the bound 0.001. Above
 * 0.1 the error of the stencil itself shows in black cloth. */
static const double least_scale = 1e-3, least_scale_of_share = 0.1;

/* Values at offset[k] h give the derivative sum coefficient[k] f / h. */
struct stencil {
    double offset[N_POINT], coefficient[N_POINT];
};
static const struct stencil middle = {{-2, -1, 1, 2}, {1 / 12.0, -8 / 12.0, 8 / 12.0, -1 / 12.0}},
                            upwards = {{0, 1, 2, 3}, {-11 / 6.0, 18 / 6.0, -9 / 6.0, 2 / 6.0}},
                            downwards = {{0, -1, -2, -3}, {11 / 6.0, -18 / 6.0, 9 / 6.0, -2 / 6.0}};

struct check {
    const struct derivative_check_request *q;
    struct derivative_check *out;
    struct radiance_source here, *point; /* at the parameters in question; at moved ones, n_flat x N_POINT */
    size_t n_flat;                       /* parameters of all sets */
    double h[SCATTERING_MAX_FLAT];
    const struct stencil *stencil[SCATTERING_MAX_FLAT];
    struct radiance_record record; /* of one path */
    /* of one configuration: sums over paths of the channels' sum */
    double radiance, jac[SCATTERING_MAX_FLAT], miss[SCATTERING_MAX_FLAT], miss2[SCATTERING_MAX_FLAT];
    /* over configurations */
    double total, slope[SCATTERING_MAX_FLAT], error[SCATTERING_MAX_FLAT], var[SCATTERING_MAX_FLAT];
};

static const struct param_info *info_of(const struct check *k, size_t p)
{
    const struct appearance *m = k->q->input.model;
    return &m->param[p % m->n_param];
}

/* ---- the model at moved parameters ---- */

static void choose_stencil(struct check *k, size_t p)
{
    const struct param_info *info = info_of(k, p);
    bool share = info->channel >= 0 || info->coordinate == PARAM_LOGIT; /* models use 1 - p */
    double v = k->q->input.param[p], least = share ? least_scale_of_share : least_scale;
    k->h[p] = relative_step * fmax(fabs(v), least * (info->upper - info->lower));
    k->stencil[p] = v - 2.0 * k->h[p] < info->lower ? &upwards : v + 2.0 * k->h[p] > info->upper ? &downwards : &middle;
}

static status prepare_points(struct check *k, struct error *err)
{
    const struct derivative_check_request *q = k->q;
    double moved[SCATTERING_MAX_FLAT];
    struct radiance_input in = q->input;
    in.want_derivative = true;
    status s = radiance_source_init(&k->here, &in, q->configuration, q->n_configuration, err);
    in.param = moved;
    for (size_t p = 0; p < k->n_flat && s == STATUS_OK; p++) {
        choose_stencil(k, p);
        if (q->skip != NULL && q->skip[p]) continue;
        k->out->checked[p] = true;
        memcpy(moved, q->input.param, k->n_flat * sizeof *moved);
        for (size_t i = 0; i < N_POINT && s == STATUS_OK; i++) {
            moved[p] = q->input.param[p] + k->stencil[p]->offset[i] * k->h[p];
            s = radiance_source_init(&k->point[p * N_POINT + i], &in, NULL, 0, err);
        }
    }
    return s;
}

/* ---- paths ---- */

/* Derivative of the recorded path's radiance by parameter p, from its values at the moved points. */
static double difference(const struct check *k, size_t p)
{
    double sum = 0;
    for (size_t i = 0; i < N_POINT; i++) {
        const struct radiance_source *at = &k->point[p * N_POINT + i];
        sum += k->stencil[p]->coefficient[i] * at->tracer->replay(at->state, k->here.state, &k->record) / k->h[p];
    }
    return sum;
}

static status add_path(struct check *k, const float value[N_VALUE], struct error *err)
{
    const struct appearance *m = k->q->input.model;
    for (int c = 0; c < 3; c++) k->radiance += (double)value[c];
    for (size_t p = 0; p < k->n_flat; p++) {
        if (!k->out->checked[p]) continue;
        double own = 0, other = difference(k, p);
        for (size_t c = 0; c < 3; c++) own += (double)value[3 + c * k->n_flat + p];
        if (!isfinite(own) || !isfinite(other))
            return error_set_field(err, STATUS_NUMERIC, info_of(k, p)->name,
                                   "model '%s' gave a value that is not finite (parameter '%s')", m->id,
                                   info_of(k, p)->name);
        k->jac[p] += own;
        k->miss[p] += own - other;
        k->miss2[p] += (own - other) * (own - other);
    }
    return STATUS_OK;
}

static status trace_path(struct check *k, size_t i_configuration, size_t i_path, struct error *err)
{
    const struct derivative_check_request *q = k->q;
    const struct rng_key key = {q->seed, q->iteration, q->replica, (uint32_t)i_configuration};
    struct rng rng;
    double xy[2];
    float value[N_VALUE] = {0};
    rng_start(&rng, &key, (uint32_t)i_path, 0);
    for (int a = 0; a < 2; a++) xy[a] = rng_double(&rng);
    k->here.tracer->record(k->here.state, i_configuration, xy, &rng, &k->record, value);
    return k->record.n_entry <= k->record.capacity ? add_path(k, value, err) : STATUS_OK;
}

static status check_configuration(struct check *k, size_t i, size_t n_path, struct error *err)
{
    const struct derivative_check_request *q = k->q;
    size_t n_done = 0, n_bounce = 0;
    k->radiance = 0;
    memset(k->jac, 0, sizeof k->jac);
    memset(k->miss, 0, sizeof k->miss);
    memset(k->miss2, 0, sizeof k->miss2);
    for (; n_done < n_path && n_bounce < MAX_BOUNCE_CONFIGURATION; n_done++) {
        status s = trace_path(k, i, n_done, err);
        if (s != STATUS_OK) return s;
        n_bounce += k->record.n_bounce;
    }
    double n = (double)n_done, weight = (q->weight != NULL ? q->weight[i] : 1.0) / n;
    k->total += weight * k->radiance;
    for (size_t p = 0; p < k->n_flat; p++) {
        k->slope[p] += weight * fabs(k->jac[p]);
        k->error[p] += weight * fabs(k->miss[p]);
        k->var[p] += weight * weight * fmax(0.0, k->miss2[p] - k->miss[p] * k->miss[p] / n);
    }
    k->out->n_path += n_done;
    k->out->n_step += n_bounce;
    return STATUS_OK;
}

static void judge(struct check *k)
{
    const struct radiance_input *in = &k->q->input;
    for (size_t p = 0; p < k->n_flat; p++) {
        if (!k->out->checked[p]) continue;
        double scale = fmax(k->slope[p], 1e-3 * k->total / fmax(fabs(in->param[p]), k->h[p]));
        if (!(scale > 0.0)) continue; /* a cloth that shows nothing */
        k->out->error[p] = k->error[p] / scale;
        k->out->error_se[p] = sqrt(k->var[p]) / scale;
        if (k->out->error[p] > k->out->error[k->out->worst]) k->out->worst = p;
    }
}

static status check_all(struct check *k, const struct progress *progress, struct error *err)
{
    const struct derivative_check_request *q = k->q;
    size_t n_path = q->n_path / (q->n_configuration > 0 ? q->n_configuration : 1);
    status s = prepare_points(k, err);
    k->record.capacity = MAX_ENTRY;
    if (s == STATUS_OK) k->record.entry = calloc(MAX_ENTRY, k->here.tracer->entry_bytes);
    if (s == STATUS_OK && k->record.entry == NULL)
        s = error_set(err, STATUS_NO_MEMORY, "cannot check derivatives: out of memory");
    for (size_t i = 0; i < q->n_configuration && s == STATUS_OK; i++)
        s = progress_cancelled(progress) ? error_set(err, STATUS_CANCELLED, "cancelled")
                                         : check_configuration(k, i, n_path > 0 ? n_path : 1, err);
    if (s == STATUS_OK) judge(k);
    free(k->record.entry);
    return s;
}

status derivative_check_run(const struct derivative_check_request *q, const struct progress *progress,
                            struct derivative_check *out, struct error *err)
{
    size_t n_flat = (q->input.n_set > 1 ? q->input.n_set : 1) * q->input.model->n_param, n_point = n_flat * N_POINT;
    memset(out, 0, sizeof *out);
    out->n_param = n_flat;
    status s = n_flat > SCATTERING_MAX_FLAT
                   ? error_set_field(err, STATUS_INVALID, "n_set", "cannot check derivatives by %zu parameters", n_flat)
                   : configuration_check(q->configuration, q->n_configuration, err);
    if (s == STATUS_OK) s = estimate_check_key(q->iteration, q->replica, err);
    if (s != STATUS_OK) return s;
    struct check *k = calloc(1, sizeof *k);
    struct radiance_source *point = calloc(n_point, sizeof *point);
    if (k != NULL && point != NULL) {
        k->q = q;
        k->out = out;
        k->point = point;
        k->n_flat = n_flat;
        s = check_all(k, progress, err);
        radiance_source_release(&k->here);
        for (size_t i = 0; i < n_point; i++) radiance_source_release(&point[i]);
    } else {
        s = error_set(err, STATUS_NO_MEMORY, "cannot check derivatives: out of memory");
    }
    free(point);
    free(k);
    return s;
}
