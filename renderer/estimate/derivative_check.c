#include "renderer/estimate/derivative_check.h"

#include "renderer/estimate/estimate_blocks.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    N_POINT = 4,
    LEAST_PATH = 2,
    MAX_ENTRY = 32768,
    MAX_BOUNCE_CONFIGURATION = 8192,
    N_VALUE = 3 + 3 * SCATTERING_MAX_FLAT
};

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

/* Sums over the paths of one configuration, for one parameter: of the tracer's derivative and of how much it misses the
 * difference by, channels added; of the derivative's absolute value, and of the miss in its direction; of squares and
 * product. */
struct path_sums {
    double jac, miss, abs_jac, along, jac2, miss2, cross;
};

struct check {
    const struct derivative_check_request *q;
    struct derivative_check *out;
    struct radiance_source here, *point; /* at the parameters in question; at moved ones, n_flat x N_POINT */
    size_t n_flat;                       /* parameters of all sets */
    double h[SCATTERING_MAX_FLAT];
    const struct stencil *stencil[SCATTERING_MAX_FLAT];
    struct radiance_record record; /* of one path */
    struct path_sums *sums;        /* n_configuration x n_flat */
    size_t *n_done;                /* paths of each configuration */
    double radiance;               /* of one configuration: sum over its paths */
    double total;                  /* over configurations: weighted mean radiances */
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

static void add_sums(struct path_sums *s, double jac, double miss)
{
    s->jac += jac;
    s->miss += miss;
    s->abs_jac += fabs(jac);
    s->along += jac < 0.0 ? -miss : miss;
    s->jac2 += jac * jac;
    s->miss2 += miss * miss;
    s->cross += jac * miss;
}

static status add_path(struct check *k, size_t i_configuration, const float value[N_VALUE], struct error *err)
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
        add_sums(&k->sums[i_configuration * k->n_flat + p], own, own - other);
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
    return k->record.n_entry <= k->record.capacity ? add_path(k, i_configuration, value, err) : STATUS_OK;
}

/* Of each path of a configuration that has been traced. */
static double path_weight(const struct check *k, size_t i_configuration)
{
    double weight = k->q->weight != NULL ? k->q->weight[i_configuration] : 1.0;
    return weight / (double)k->n_done[i_configuration];
}

static status check_configuration(struct check *k, size_t i, size_t n_path, struct error *err)
{
    size_t n_done = 0, n_bounce = 0;
    k->radiance = 0;
    for (; n_done < LEAST_PATH || (n_done < n_path && n_bounce < MAX_BOUNCE_CONFIGURATION); n_done++) {
        status s = trace_path(k, i, n_done, err);
        if (s != STATUS_OK) return s;
        n_bounce += k->record.n_bounce;
    }
    k->n_done[i] = n_done;
    k->total += path_weight(k, i) * k->radiance;
    k->out->n_path += n_done;
    k->out->n_step += n_bounce;
    return STATUS_OK;
}

/* ---- judgement ---- */

/* Mean of the estimated standard deviation of n >= 2 normal deviates, in units of the true one (c4 of quality control;
 * this approximation is off by 0.3 % for two and by less for more). */
static double c4(size_t n) { return (double)(4 * n - 4) / (double)(4 * n - 3); }

/* Share of the derivatives that all paths together miss the differences by. */
static double common_share(const struct check *k, size_t p)
{
    double along = 0, abs_jac = 0;
    for (size_t i = 0; i < k->q->n_configuration; i++) {
        along += path_weight(k, i) * k->sums[i * k->n_flat + p].along;
        abs_jac += path_weight(k, i) * k->sums[i * k->n_flat + p].abs_jac;
    }
    return abs_jac > 0.0 ? along / abs_jac : 0.0;
}

/* Variance of the sum of n misses, from their scatter after `share` of the derivative has been taken off each: a fault
 * scatters as the derivative does, and is no noise. */
static double variance_of_sum(const struct path_sums *s, size_t n, double share)
{
    double sum = s->miss - share * s->jac, sum2 = s->miss2 - 2.0 * share * s->cross + share * share * s->jac2;
    return fmax(0.0, sum2 - sum * sum / (double)n) * (double)n / (double)(n - 1);
}

static void judge_parameter(const struct check *k, size_t p)
{
    const double mean_of_abs2 = 2.0 / M_PI, share = common_share(k, p);
    double value = fabs(k->q->input.param[p]), slope = 0, error = 0, noise = 0, noise_var = 0;
    for (size_t i = 0; i < k->q->n_configuration; i++) {
        const struct path_sums *s = &k->sums[i * k->n_flat + p];
        double weight = path_weight(k, i), mean_of_se = c4(k->n_done[i]);
        double var = weight * weight * variance_of_sum(s, k->n_done[i], share);
        slope += weight * fabs(s->jac);
        error += weight * fabs(s->miss);
        noise += sqrt(mean_of_abs2 * var) / mean_of_se;
        noise_var += (1.0 - 2.0 * mean_of_abs2 + mean_of_abs2 / (mean_of_se * mean_of_se)) * var;
    }
    double scale = fmax(slope, 1e-3 * k->total / fmax(value, k->h[p]));
    if (!(scale > 0.0)) return; /* a cloth that shows nothing */
    k->out->error[p] = error / scale;
    k->out->noise[p] = noise / scale;
    k->out->noise_se[p] = sqrt(noise_var) / scale;
}

double derivative_check_excess(const struct derivative_check *check, size_t p)
{
    return check->error[p] - check->noise[p] - 3.0 * check->noise_se[p];
}

/* The first of the checked parameters with the largest excess; 0 if none is checked. */
static size_t most_excessive(const struct derivative_check *check)
{
    size_t worst = check->n_param;
    for (size_t p = 0; p < check->n_param; p++) {
        if (!check->checked[p]) continue;
        if (worst == check->n_param || derivative_check_excess(check, p) > derivative_check_excess(check, worst))
            worst = p;
    }
    return worst < check->n_param ? worst : 0;
}

static void judge(struct check *k)
{
    for (size_t p = 0; p < k->n_flat; p++)
        if (k->out->checked[p]) judge_parameter(k, p);
    k->out->worst = most_excessive(k->out);
}

static status allocate(struct check *k, struct error *err)
{
    const size_t n = k->q->n_configuration;
    k->record.capacity = MAX_ENTRY;
    k->record.entry = calloc(MAX_ENTRY, k->here.tracer->entry_bytes);
    k->sums = calloc(n * k->n_flat + 1, sizeof *k->sums);
    k->n_done = calloc(n + 1, sizeof *k->n_done);
    return k->record.entry != NULL && k->sums != NULL && k->n_done != NULL
               ? STATUS_OK
               : error_set(err, STATUS_NO_MEMORY, "cannot check derivatives: out of memory");
}

static status check_all(struct check *k, const struct progress *progress, struct error *err)
{
    const struct derivative_check_request *q = k->q;
    size_t n_path = q->n_path / (q->n_configuration > 0 ? q->n_configuration : 1);
    status s = prepare_points(k, err);
    if (s == STATUS_OK) s = allocate(k, err);
    for (size_t i = 0; i < q->n_configuration && s == STATUS_OK; i++)
        s = progress_cancelled(progress) ? error_set(err, STATUS_CANCELLED, "cancelled")
                                         : check_configuration(k, i, n_path, err);
    if (s == STATUS_OK) judge(k);
    free(k->record.entry);
    free(k->sums);
    free(k->n_done);
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
