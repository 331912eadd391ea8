#include "optimizer/report/textures/least_squares.h"

#include "base/small_matrix.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_STEPS = 40, MOST_TRIES = 8, MAX = LEAST_SQUARES_MAX_UNKNOWN };
static const double difference = 1e-4, least_decrease = 1e-4, least_damping = 1e-6;

struct work {
    const struct least_squares *p;
    double *residual, *trial; /* n_residual each */
    double *jacobian;         /* n_unknown x n_residual, by unknowns in units of their range */
    double normal[MAX][MAX], gradient[MAX];
    bool held[MAX];
};

static double sum_of_squares(const double *r, size_t n)
{
    double sum = 0.0;
    for (size_t i = 0; i < n; i++) sum += r[i] * r[i];
    return sum;
}

static double range_of(const struct least_squares *p, size_t k) { return p->upper[k] - p->lower[k]; }

static void find_jacobian(struct work *w, const double *x)
{
    const struct least_squares *p = w->p;
    double moved[MAX];
    memcpy(moved, x, p->n_unknown * sizeof *x);
    for (size_t k = 0; k < p->n_unknown; k++) {
        const double side = x[k] + difference * range_of(p, k) <= p->upper[k] ? 1.0 : -1.0;
        double *column = w->jacobian + k * p->n_residual;
        moved[k] = x[k] + side * difference * range_of(p, k);
        p->residuals(p->context, moved, column);
        moved[k] = x[k];
        for (size_t i = 0; i < p->n_residual; i++) column[i] = (column[i] - w->residual[i]) * side / difference;
    }
}

static void find_normal_equations(struct work *w, const double *x)
{
    const struct least_squares *p = w->p;
    const size_t n = p->n_residual;
    for (size_t a = 0; a < p->n_unknown; a++) {
        const double *ja = w->jacobian + a * n;
        w->gradient[a] = 0.0;
        for (size_t i = 0; i < n; i++) w->gradient[a] += ja[i] * w->residual[i];
        for (size_t b = 0; b <= a; b++) {
            const double *jb = w->jacobian + b * n;
            double sum = 0.0;
            for (size_t i = 0; i < n; i++) sum += ja[i] * jb[i];
            w->normal[a][b] = w->normal[b][a] = sum;
        }
        w->held[a] = (x[a] <= p->lower[a] && w->gradient[a] > 0.0) || (x[a] >= p->upper[a] && w->gradient[a] < 0.0);
    }
}

/* Solves (normal + damping diagonal) step = -gradient over the unknowns that are not held. */
static bool solve(const struct work *w, double damping, double step[MAX])
{
    const size_t n = w->p->n_unknown;
    double m[MAX * MAX], floor_of_diagonal = 0.0;
    for (size_t a = 0; a < n; a++) floor_of_diagonal = fmax(floor_of_diagonal, 1e-9 * w->normal[a][a]);
    for (size_t a = 0; a < n; a++) {
        for (size_t b = 0; b < a; b++) m[a * n + b] = w->held[a] || w->held[b] ? 0.0 : w->normal[a][b];
        const double own = w->normal[a][a];
        m[a * n + a] = w->held[a] ? 1.0 : own + damping * fmax(own, floor_of_diagonal) + floor_of_diagonal;
        step[a] = w->held[a] ? 0.0 : -w->gradient[a];
    }
    if (!small_factor(m, n, 0.0)) return false;
    small_solve(m, n, step, 1);
    return true;
}

/* Tries steps of more and more damping. Returns whether one lowers the value, which x then has. */
static bool advance(struct work *w, double *damping, double *x, double *value)
{
    const struct least_squares *p = w->p;
    for (int k = 0; k < MOST_TRIES; k++, *damping *= 5.0) {
        double step[MAX], to[MAX], there;
        if (!solve(w, *damping, step)) continue;
        for (size_t a = 0; a < p->n_unknown; a++)
            to[a] = fmin(fmax(x[a] + step[a] * range_of(p, a), p->lower[a]), p->upper[a]);
        p->residuals(p->context, to, w->trial);
        there = sum_of_squares(w->trial, p->n_residual);
        if (!(there < *value)) continue;
        *value = there;
        *damping = fmax(*damping / 10.0, least_damping);
        memcpy(x, to, p->n_unknown * sizeof *x);
        memcpy(w->residual, w->trial, p->n_residual * sizeof *w->residual);
        return true;
    }
    return false;
}

status least_squares_run(const struct least_squares *p, double *x, double *value, struct error *err)
{
    struct work w = {.p = p};
    double damping = 0.01;
    w.residual = calloc(p->n_residual * (p->n_unknown + 2), sizeof *w.residual);
    if (w.residual == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot fit textures: out of memory");
    w.trial = w.residual + p->n_residual;
    w.jacobian = w.trial + p->n_residual;
    for (size_t k = 0; k < p->n_unknown; k++) x[k] = fmin(fmax(x[k], p->lower[k]), p->upper[k]);
    p->residuals(p->context, x, w.residual);
    *value = sum_of_squares(w.residual, p->n_residual);
    for (int k = 0; k < MOST_STEPS; k++) {
        const double before = *value;
        find_jacobian(&w, x);
        find_normal_equations(&w, x);
        if (!advance(&w, &damping, x, value) || *value > (1.0 - least_decrease) * before) break;
    }
    free(w.residual);
    return STATUS_OK;
}
