/* The fit of the plain BRDF: colours solved exactly, shapes searched. */
#include "optimizer/fit/baseline/plain_brdf.h"
#include "optimizer/fit/baseline/plain_brdf_terms.h"

#include "base/small_matrix.h"
#include "optimizer/fit/objective/objective.h"

#include <math.h>
#include <nlopt.h>
#include <stdlib.h>
#include <string.h>

enum { N_SHAPE = 3, N_SEARCH = 4, MAX_EVALUATIONS = 2000 };

static const double shape_lower[N_SHAPE] = {0.0, 0.05, 0.05}, shape_upper[N_SHAPE] = {2.0, 1.0, 1.0};
static const double colour_upper[PLAIN_N_COLOUR] = {1.0, 1.0, 2.0};

struct row {
    const struct observation *o;
    double weight;
};

struct problem {
    size_t n_row;
    struct row *row;
    struct plain_term *term; /* of the shape under trial */
    bool separable_masking;
};

/* ---- the colours of one channel ---- */

/* Normal equations 1/2 x'Ax - b'x of one channel; rest: sum of weighted squares at x = 0. */
struct normal {
    double a[PLAIN_N_COLOUR * PLAIN_N_COLOUR], b[PLAIN_N_COLOUR], rest;
};

static double normal_value(const struct normal *m, const double *x)
{
    double value = m->rest;
    for (size_t i = 0; i < PLAIN_N_COLOUR; i++) {
        value -= 2.0 * m->b[i] * x[i];
        for (size_t j = 0; j < PLAIN_N_COLOUR; j++) value += m->a[i * PLAIN_N_COLOUR + j] * x[i] * x[j];
    }
    return value;
}

/* Minimum with some unknowns held at a bound: code is a number of three digits to base 3 (0 free, 1 lower, 2 upper). */
static bool solve_active_set(const struct normal *m, int code, double x[PLAIN_N_COLOUR])
{
    size_t free_index[PLAIN_N_COLOUR], n = 0;
    double a[PLAIN_N_COLOUR * PLAIN_N_COLOUR], b[PLAIN_N_COLOUR];
    for (size_t i = 0; i < PLAIN_N_COLOUR; i++, code /= 3) {
        x[i] = code % 3 == 2 ? colour_upper[i] : 0.0;
        if (code % 3 == 0) free_index[n++] = i;
    }
    for (size_t r = 0; r < n; r++) {
        const double *line = &m->a[free_index[r] * PLAIN_N_COLOUR];
        b[r] = m->b[free_index[r]];
        for (size_t k = 0; k < PLAIN_N_COLOUR; k++) b[r] -= line[k] * x[k]; /* free ones are 0 here */
        for (size_t c = 0; c < n; c++) a[r * n + c] = line[free_index[c]];
    }
    if (!small_factor(a, n, 0.0)) return false;
    small_solve(a, n, b, 1);
    for (size_t r = 0; r < n; r++) {
        if (!(b[r] >= 0.0 && b[r] <= colour_upper[free_index[r]])) return false;
        x[free_index[r]] = b[r];
    }
    return true;
}

/* The best of all active sets: exact, and the same on every machine. */
static double solve_colours(const struct normal *m, double best[PLAIN_N_COLOUR])
{
    double least = INFINITY, x[PLAIN_N_COLOUR];
    for (int code = 0; code < 27; code++) {
        if (!solve_active_set(m, code, x)) continue;
        double value = normal_value(m, x);
        if (value < least) {
            least = value;
            memcpy(best, x, sizeof x);
        }
    }
    return least;
}

static void channel_normal(const struct problem *p, size_t channel, struct normal *m)
{
    *m = (struct normal){0};
    for (size_t i = 0; i < p->n_row; i++) {
        const struct plain_term *t = &p->term[i];
        if (t->behind) continue;
        double w = p->row[i].weight, y = p->row[i].o->mean_rgb[channel] - t->constant;
        m->rest += w * y * y;
        for (size_t r = 0; r < PLAIN_N_COLOUR; r++) {
            m->b[r] += w * t->factor[r] * y;
            for (size_t c = 0; c < PLAIN_N_COLOUR; c++) m->a[r * PLAIN_N_COLOUR + c] += w * t->factor[r] * t->factor[c];
        }
    }
}

static double solve_transmission(const struct problem *p, size_t channel, double *transmission)
{
    double xx = 0.0, xy = 0.0, yy = 0.0;
    for (size_t i = 0; i < p->n_row; i++) {
        if (!p->term[i].behind) continue;
        double w = p->row[i].weight, x = p->term[i].factor[0], y = p->row[i].o->mean_rgb[channel];
        xx += w * x * x;
        xy += w * x * y;
        yy += w * y * y;
    }
    *transmission = xx > 0.0 ? fmin(fmax(xy / xx, 0.0), 1.0) : 0.0;
    return yy - 2.0 * *transmission * xy + *transmission * *transmission * xx;
}

/* ---- the shape ---- */

/* Objective of a shape with the best colours, which go to *b if that is not NULL. */
static double evaluate_shape(const struct problem *p, const double x[N_SHAPE], struct plain_brdf *b)
{
    const struct plain_shape shape = {x[0], x[1], x[2], p->separable_masking};
    double value = 0.0;
    for (size_t i = 0; i < p->n_row; i++) plain_terms(&shape, &p->row[i].o->configuration, &p->term[i]);
    for (size_t c = 0; c < 3; c++) {
        struct normal m;
        double colour[PLAIN_N_COLOUR] = {0}, transmission;
        channel_normal(p, c, &m);
        value += solve_colours(&m, colour) + solve_transmission(p, c, &transmission);
        if (b == NULL) continue;
        b->diffuse_rgb[c] = colour[PLAIN_DIFFUSE];
        b->f0_rgb[c] = colour[PLAIN_F0];
        b->sheen_rgb[c] = colour[PLAIN_SHEEN];
        b->transmission_rgb[c] = transmission;
    }
    if (b != NULL) {
        b->retro = x[0];
        b->roughness = x[1];
        b->sheen_roughness = x[2];
        b->separable_masking = p->separable_masking;
    }
    return value;
}

static double search_function(unsigned n, const double *x, double *gradient, void *context)
{
    (void)n;
    (void)gradient;
    return evaluate_shape(context, x, NULL);
}

struct start {
    double value, x[N_SHAPE];
};

/* Keeps the N_SEARCH best starts, best first. */
static void keep_start(struct start best[N_SEARCH], const struct start *s)
{
    size_t at = N_SEARCH;
    while (at > 0 && s->value < best[at - 1].value) at--;
    if (at == N_SEARCH) return;
    memmove(&best[at + 1], &best[at], (N_SEARCH - 1 - at) * sizeof *best);
    best[at] = *s;
}

static void search_grid(struct problem *p, struct start best[N_SEARCH])
{
    static const double retro[] = {0.0, 0.4, 1.0, 1.6}, roughness[] = {0.1, 0.2, 0.35, 0.5, 0.7, 0.9},
                        sheen_roughness[] = {0.08, 0.2, 0.5, 0.9};
    for (size_t k = 0; k < N_SEARCH; k++) best[k].value = INFINITY;
    for (size_t i = 0; i < 4; i++)
        for (size_t j = 0; j < 6; j++)
            for (size_t k = 0; k < 4; k++) {
                struct start s = {.x = {retro[i], roughness[j], sheen_roughness[k]}};
                s.value = evaluate_shape(p, s.x, NULL);
                keep_start(best, &s);
            }
}

/* The best shape for one kind of masking; *value: its objective. */
static status fit_shape(struct problem *p, struct start *result, struct error *err)
{
    struct start best[N_SEARCH];
    search_grid(p, best);
    *result = best[0];
    nlopt_opt opt = nlopt_create(NLOPT_LN_SBPLX, N_SHAPE);
    if (opt == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot fit the plain BRDF: out of memory");
    nlopt_set_min_objective(opt, search_function, p);
    nlopt_set_lower_bounds(opt, shape_lower);
    nlopt_set_upper_bounds(opt, shape_upper);
    nlopt_set_xtol_rel(opt, 1e-6);
    nlopt_set_maxeval(opt, MAX_EVALUATIONS);
    for (size_t k = 0; k < N_SEARCH; k++) {
        struct start s = best[k];
        if (!isfinite(s.value)) continue;
        nlopt_optimize(opt, s.x, &s.value); /* whatever ends it, s holds the best point found */
        if (s.value < result->value) *result = s;
    }
    nlopt_destroy(opt);
    return STATUS_OK;
}

static status collect_rows(const struct observation_set *rows, struct problem *p, struct error *err)
{
    p->row = malloc((rows->n + 1) * sizeof *p->row);
    p->term = malloc((rows->n + 1) * sizeof *p->term);
    if (p->row == NULL || p->term == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot fit the plain BRDF: out of memory");
    for (size_t i = 0; i < rows->n; i++) {
        const struct observation *o = &rows->item[i];
        if (o->weight == 0.0 || observation_is_contrast(o)) continue;
        p->row[p->n_row++] = (struct row){o, objective_weight(o)};
    }
    if (p->n_row == 0) return error_set(err, STATUS_INVALID, "cannot fit the plain BRDF: no row has a weight");
    return STATUS_OK;
}

status plain_brdf_fit(const struct observation_set *rows, struct plain_brdf *b, struct error *err)
{
    struct problem p = {0};
    double least = INFINITY;
    status s = collect_rows(rows, &p, err);
    for (int separable = 0; separable < 2 && s == STATUS_OK; separable++) {
        struct start found;
        p.separable_masking = separable != 0;
        s = fit_shape(&p, &found, err);
        if (s == STATUS_OK && found.value < least) least = evaluate_shape(&p, found.x, b);
    }
    free(p.row);
    free(p.term);
    return s;
}
