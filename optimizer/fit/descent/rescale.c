#include "optimizer/fit/descent/rescale.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct published_curve {
    const char *symbol;
    double a, b, m, first, last;
    bool flipped; /* 1 - (a + b m^(i-1)) */
};

static const struct published_curve published[] = {
    {"C_R", 1.02296, -0.032255, 1.5403, 0.001, 0.999, true},   {"beta_R", -7.0, 8.0, 1.1, 1.0, 10.0, false},
    {"C_TT", 1.02296, -1.02197, 0.64922, 0.001, 0.999, false}, {"beta_TT", -0.91, 1.9, 1.5, 1.0, 45.0, false},
    {"gamma_TT", -0.91, 1.9, 1.5, 1.0, 45.0, false},
};

bool rescale_published_points(const char *symbol, double c[RESCALE_POINTS])
{
    for (size_t k = 0; k < sizeof published / sizeof published[0]; k++) {
        const struct published_curve *t = &published[k];
        if (strcmp(t->symbol, symbol) != 0) continue;
        for (int i = 0; i < RESCALE_POINTS; i++) {
            double value = t->a + t->b * pow(t->m, i);
            c[i] = t->flipped ? 1.0 - value : value;
        }
        c[0] = t->first;
        c[RESCALE_POINTS - 1] = t->last;
        return true;
    }
    return false;
}

void rescale_points(const struct param_info *info, const struct coordinate *k, struct rescale_curve *curve)
{
    double c[RESCALE_POINTS];
    bool known = rescale_published_points(info->symbol, c);
    curve->n = 0;
    curve->c[curve->n++] = k->param_lower;
    for (int i = 0; i < RESCALE_POINTS; i++) {
        double value = known ? param_from_file_unit(info, c[i])
                             : coordinate_to_param(k, k->lower + (k->upper - k->lower) * i / (RESCALE_POINTS - 1.0));
        if (value > curve->c[curve->n - 1] && value < k->param_upper && curve->n < RESCALE_POINTS - 1)
            curve->c[curve->n++] = value;
    }
    curve->c[curve->n++] = k->param_upper;
    memset(curve->r, 0, sizeof curve->r);
}

static size_t piece_of(const double *knot, size_t n, double v)
{
    size_t i = 0;
    while (i + 2 < n && v > knot[i + 1]) i++;
    return i;
}

static double interpolate(const double *from, const double *to, size_t n, double v)
{
    if (v <= from[0]) return to[0];
    if (v >= from[n - 1]) return to[n - 1];
    size_t i = piece_of(from, n, v);
    double width = from[i + 1] - from[i];
    return width > 0.0 ? to[i] + (to[i + 1] - to[i]) * (v - from[i]) / width : to[i];
}

double rescale_forward(const struct rescale_curve *curve, double p)
{
    return interpolate(curve->c, curve->r, curve->n, p);
}
double rescale_backward(const struct rescale_curve *curve, double r)
{
    return interpolate(curve->r, curve->c, curve->n, r);
}

double rescale_slope(const struct rescale_curve *curve, double p)
{
    size_t i = piece_of(curve->c, curve->n, p);
    return (curve->c[i + 1] - curve->c[i]) / (curve->r[i + 1] - curve->r[i]);
}

static double curve_step(const struct observation_set *o, const struct estimate *x, const struct estimate *y)
{
    double sum = 0.0;
    for (size_t i = 0; i < o->n; i++)
        sum += objective_weight(&o->item[i]) * sqrt(objective_image_difference(x[i].mean, y[i].mean));
    return sum;
}

/* The progress of the next rendering as a part of the whole fit's. */
static struct progress_part part_of_budget(const struct fit_problem *problem, const size_t *n_path,
                                           uint64_t n_path_used)
{
    double budget = (double)problem->path_budget, call = 0.0;
    for (size_t i = 0; i < problem->estimator->n_configuration; i++) call += (double)n_path[i];
    double from = budget > 0.0 ? fmin(1.0, (double)n_path_used / budget) : 0.0;
    return (struct progress_part){
        .outer = problem->progress, .from = from, .share = budget > 0.0 ? fmin(1.0 - from, call / budget) : 0.0};
}

/* Inputs, buffers and totals of the measurement of all curves. */
struct measurement {
    const struct fit_problem *problem;
    const struct coordinate *k;
    const size_t *n_path;       /* of one rendering, per configuration */
    struct estimate *buffer[2]; /* the last two renderings */
    uint64_t n_path_used;
    double wall_s;
};

/* Measures one curve. All slots of the same symbol move together, each within its own bounds, because beyond the
 * bounds of a tied parameter the parameters that follow it would leave the model's range. */
static status measure_symbol(struct measurement *m, size_t first, size_t n_slot, struct rescale_curve *curve,
                             struct error *err)
{
    double param[FIT_MAX_PARAM];
    const struct fit_problem *problem = m->problem;
    const struct coordinate *k = m->k;
    const struct estimator *e = problem->estimator;
    for (size_t p = 0; p < problem->n_param; p++) param[p] = problem->parameter[p].start;
    for (size_t j = 0; j < curve->n; j++) {
        for (size_t p = first; p < first + n_slot; p++)
            param[p] = fmin(fmax(curve->c[j], k[p].param_lower), k[p].param_upper);
        struct estimator_call call = {param, m->n_path, 0, REPLICA_RESCALE, false, true};
        double seconds = 0.0;
        struct progress_part part = part_of_budget(problem, m->n_path, m->n_path_used);
        struct progress progress = progress_of_part(&part);
        status s = e->run(e->context, &call, &progress, m->buffer[j % 2], &seconds, err);
        if (s != STATUS_OK) return s;
        m->wall_s += seconds;
        for (size_t i = 0; i < e->n_configuration; i++) m->n_path_used += m->buffer[j % 2][i].n_path;
        double step = j > 0 ? curve_step(problem->observation, m->buffer[0], m->buffer[1]) : 0.0;
        /* a parameter without any effect still needs a curve that can be inverted */
        if (j > 0) curve->r[j] = curve->r[j - 1] + fmax(step, 1e-9) / (double)n_slot;
    }
    return STATUS_OK;
}

/* Returns the first channel of the same colour that has the bounds of parameter i, and so its curve too; i when there
 * is none. */
static size_t owner_of_curve(const struct fit_problem *problem, const struct coordinate *k, size_t i)
{
    size_t same = i;
    while (same > 0 && strcmp(problem->info[same - 1].symbol, problem->info[i].symbol) == 0) same--;
    while (same < i && (k[same].param_lower != k[i].param_lower || k[same].param_upper != k[i].param_upper)) same++;
    return same;
}

size_t rescale_n_curve(const struct fit_problem *problem, const struct coordinate *k)
{
    size_t n = 0;
    for (size_t i = 0; i < problem->n_param; i++) n += owner_of_curve(problem, k, i) == i;
    return n;
}

status rescale_measure(const struct fit_problem *problem, const struct coordinate *k, const size_t *n_path,
                       struct rescale_curve *curve, uint64_t *n_path_used, double *wall_s, struct error *err)
{
    struct measurement m = {
        .problem = problem, .k = k, .n_path = n_path, .n_path_used = *n_path_used, .wall_s = *wall_s};
    status s = STATUS_OK;
    m.buffer[0] = calloc(2 * problem->estimator->n_configuration, sizeof(struct estimate));
    if (m.buffer[0] == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot measure rescaling curves: out of memory");
    m.buffer[1] = m.buffer[0] + problem->estimator->n_configuration;
    for (size_t p = 0, n_slot; p < problem->n_param && s == STATUS_OK; p += n_slot) {
        for (n_slot = 1; p + n_slot < problem->n_param; n_slot++)
            if (strcmp(problem->info[p + n_slot].symbol, problem->info[p].symbol) != 0) break;
        for (size_t i = p; i < p + n_slot && s == STATUS_OK; i++) {
            size_t same = owner_of_curve(problem, k, i);
            if (same < i) {
                curve[i] = curve[same];
                continue;
            }
            rescale_points(&problem->info[i], &k[i], &curve[i]);
            s = measure_symbol(&m, p, n_slot, &curve[i], err);
        }
    }
    *n_path_used = m.n_path_used;
    *wall_s = m.wall_s;
    free(m.buffer[0]);
    return s;
}
