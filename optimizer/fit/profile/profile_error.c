#include "optimizer/fit/profile/profile_error.h"
#include "base/small_matrix.h"
#include "optimizer/fit/linear/uncertainty.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N = PROFILE_MAX_UNKNOWN, MOST_GROUP = 24, ROWS_OF_GROUP = 6 };
_Static_assert((int)SMALL_MATRIX_MAX >= FIT_MAX_PARAM, "matrices of all unknowns can be inverted");

struct sorted_row {
    double phi_rad;
    size_t i;
};

static int by_phi(const void *a, const void *b)
{
    const struct sorted_row *x = a, *y = b;
    if (x->phi_rad != y->phi_rad) return x->phi_rad < y->phi_rad ? -1 : 1;
    return x->i < y->i ? -1 : x->i > y->i;
}

/* Adds sum over groups of g g', g the sum of J' r / e^2 over a group of rows of neighbouring phi. */
static void add_groups(const struct profile_search *s, const struct sorted_row *row, double *spread)
{
    const struct profile_target *t = s->target;
    const struct fiber_profile *p = t->problem->profile;
    const size_t n = t->n_unknown;
    size_t n_group = p->n / ROWS_OF_GROUP;
    n_group = n_group < 2 ? 2 : n_group > MOST_GROUP ? MOST_GROUP : n_group;
    const double correction = (double)n_group / (double)(n_group - 1);
    for (size_t group = 0, i = 0; group < n_group; group++) {
        double g[N] = {0};
        for (; i < (group + 1) * p->n / n_group; i++)
            for (size_t k = row[i].i * p->n_channel; k < (row[i].i + 1) * p->n_channel; k++) {
                const double r = (s->here.value[k] - t->measured[k]) / (s->error[k] * s->error[k]);
                for (size_t u = 0; u < n; u++) g[u] += s->here.jac[k * n + u] * r;
            }
        for (size_t u = 0; u < n; u++)
            for (size_t v = 0; v < n; v++) spread[u * n + v] += correction * g[u] * g[v];
    }
}

/* Sandwich variance of free unknown a: row a of inverse, times the spread, times itself. */
static double sandwich(const double *inverse, const double *spread, const size_t *index, size_t m, size_t n, size_t a)
{
    double sum = 0.0;
    for (size_t b = 0; b < m; b++)
        for (size_t c = 0; c < m; c++) sum += inverse[a * m + b] * spread[index[b] * n + index[c]] * inverse[a * m + c];
    return sum;
}

/* The variance of an unknown that the allowed range alone gives, as a weak prior: uniform over it. */
static double range_variance(const struct profile_target *t, size_t u)
{
    if (u == t->i_scale) return 1e2;               /* ln of the scale */
    if (u == t->i_turn) return M_PI * M_PI / 12.0; /* half a turn: then the section is the same */
    const double range = t->coordinate[u].upper - t->coordinate[u].lower;
    return range * range / 12.0;
}

/* Standard deviations of all unknowns in fit coordinates; 0 where fixed. */
static void deviations(const struct profile_search *s, double *sd)
{
    const struct profile_target *t = s->target;
    const struct fiber_profile *p = t->problem->profile;
    const size_t n = t->n_unknown;
    double h[N * N], g[N], spread[N * N] = {0}, part[N * N], inverse[N * N];
    size_t index[N], m = 0;
    struct sorted_row *row = calloc(p->n, sizeof *row);
    for (size_t i = 0; i < p->n && row != NULL; i++) row[i] = (struct sorted_row){p->row[i].phi_rad, i};
    if (row != NULL) {
        qsort(row, p->n, sizeof *row, by_phi);
        add_groups(s, row, spread);
    }
    free(row);
    profile_search_normal(s, h, g);
    for (size_t u = 0; u < n; u++)
        if (!t->fixed[u]) index[m++] = u;
    for (size_t a = 0; a < m; a++)
        for (size_t b = 0; b < m; b++)
            part[a * m + b] = h[index[a] * n + index[b]] + (a == b ? 1.0 / range_variance(t, index[a]) : 0.0);
    memset(sd, 0, n * sizeof *sd);
    const bool known = small_invert(part, m, inverse);
    for (size_t a = 0; a < m; a++)
        sd[index[a]] = known ? sqrt(fmax(inverse[a * m + a], sandwich(inverse, spread, index, m, n, a)))
                             : sqrt(range_variance(t, index[a]));
}

/* Half of the standard deviation of an unknown turn. */
static const double determined_turn_rad = 0.5 * M_PI / 3.4641016151377544;

static bool near_bound(const struct coordinate *k, double x)
{
    const double margin = 1e-3 * (k->upper - k->lower);
    return x <= k->lower + margin || x >= k->upper - margin;
}

void profile_error_put(const struct profile_search *s, struct profile_fit *fit)
{
    const struct profile_target *t = s->target;
    const struct fit_layout *l = &t->layout;
    double sd[N], unknown[FIT_MAX_PARAM], se[FIT_MAX_PARAM];
    deviations(s, sd);
    for (size_t u = 0; u < l->n_unknown; u++) {
        const struct coordinate *k = &t->coordinate[u];
        unknown[u] = t->fixed[u] ? l->parameter[u].start : coordinate_to_param(k, s->here.x[u]);
        const double uniform = (k->param_upper - k->param_lower) / sqrt(12.0);
        se[u] = t->fixed[u] ? 0.0 : fmin(coordinate_slope(k, unknown[u]) * sd[u], uniform);
    }
    fit_layout_full(l, unknown, fit->param);
    for (size_t p = 0; p < l->n_full; p++) {
        const size_t u = l->owner[p];
        fit->se_param[p] = l->ratio[p] * se[u];
        fit->at_bound[p] = !t->fixed[u] && near_bound(&t->coordinate[u], s->here.x[u]);
        fit->determined[p] = t->fixed[u] || uncertainty_determined(&t->coordinate[u], sd[u], se[u]);
    }
    fit->scale = exp(s->here.x[t->i_scale]);
    fit->scale_se = fit->scale * sd[t->i_scale];
    fit->has_turn = profile_model_turns(t->problem->model, t->problem->profile);
    fit->turn_rad = s->here.x[t->i_turn] - M_PI * floor(s->here.x[t->i_turn] / M_PI);
    fit->turn_se_rad = sd[t->i_turn];
    fit->turn_determined = t->fixed[t->i_turn] || sd[t->i_turn] < determined_turn_rad;
}
