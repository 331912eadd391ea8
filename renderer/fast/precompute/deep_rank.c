#include "renderer/fast/precompute/deep_rank.h"
#include "renderer/fast/precompute/distance_components.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct rank_job {
    const struct deep_halves *t;
    size_t n_column, n_all;
    struct thread_pool *pool;
    float *scaled[2]; /* n_view x n_column: the halves without their means, times the roots of the areas */
    float *component; /* DEEP_RANK_MOST x n_column, unit and orthogonal */
};

static double scale_of(const struct rank_job *x, size_t i)
{
    return sqrt(x->t->view_area[i / x->n_column] * x->t->light_area[i % x->n_column / 3]);
}

static double sum_of(const double *number, size_t n)
{
    double sum = 0.0;
    for (size_t i = 0; i < n; i++) sum += number[i];
    return sum;
}

/* Splits half h of a table into its means over views and over lights and the rest, in x->scaled[h]. Adds half of the
 * means to value, and with the sign of the half, times the roots of the areas, to off. mean: 3 n_view + n_column. */
static void split(const struct rank_job *x, size_t h, double *mean, double *value, double *off)
{
    const double *table = x->t->half[h], *view_area = x->t->view_area, *light_area = x->t->light_area;
    double *of_view = mean, *of_light = mean + 3 * x->t->n_view, of_all[3] = {0.0};
    double views = sum_of(view_area, x->t->n_view), lights = sum_of(light_area, x->t->n_light);
    memset(mean, 0, (3 * x->t->n_view + x->n_column) * sizeof *mean);
    for (size_t i = 0; i < x->n_all; i++) {
        size_t view = i / x->n_column, column = i % x->n_column;
        of_view[3 * view + i % 3] += light_area[column / 3] / lights * table[i];
        of_light[column] += view_area[view] / views * table[i];
    }
    for (size_t i = 0; i < x->n_column; i++) of_all[i % 3] += light_area[i / 3] / lights * of_light[i];
    for (size_t i = 0; i < x->n_all; i++) {
        double means = of_view[3 * (i / x->n_column) + i % 3] + of_light[i % x->n_column] - of_all[i % 3];
        double scale = scale_of(x, i);
        value[i] += 0.5 * means;
        off[i] += (h == 0 ? 0.5 : -0.5) * scale * means;
        x->scaled[h][i] = (float)(scale * (table[i] - means));
    }
}

/* The strongest components of a matrix, in x->component. */
static status take_apart(const struct rank_job *x, float *matrix, struct error *err)
{
    return distance_components(matrix, x->t->n_view, x->n_column, DEEP_RANK_MOST, x->pool, NULL, x->component, err);
}

static double along(const struct rank_job *x, const float *row, size_t k)
{
    const float *component = x->component + k * x->n_column;
    double sum = 0.0;
    for (size_t i = 0; i < x->n_column; i++) sum += (double)row[i] * (double)component[i];
    return sum;
}

/* Products of a matrix with itself and with the other half's, of each component and (the last) of the whole. */
struct products {
    double own[DEEP_RANK_MOST + 1], other[DEEP_RANK_MOST + 1];
};

static void add_products(const struct rank_job *x, const float *matrix, const float *others, struct products *p)
{
    for (size_t i = 0; i < x->n_all; i++) {
        p->own[DEEP_RANK_MOST] += (double)matrix[i] * (double)matrix[i];
        p->other[DEEP_RANK_MOST] += (double)matrix[i] * (double)others[i];
    }
    for (size_t k = 0; k < DEEP_RANK_MOST; k++)
        for (size_t v = 0; v < x->t->n_view; v++) {
            double own = along(x, matrix + v * x->n_column, k);
            p->own[k] += own * own;
            p->other[k] += own * along(x, others + v * x->n_column, k);
        }
}

/* The rank, and the factor of the rest, by which a half is nearest to the other one. The share r of the rest that is
 * no noise in a half makes the factor r there, and 2 r / (1 + r) in the mean of two halves. */
static void choose(const struct products *p, struct deep_rank_fit *fit)
{
    double own = p->own[DEEP_RANK_MOST], other = p->other[DEEP_RANK_MOST], nearer = 0.0, most = -1.0;
    for (size_t k = 0; k <= DEEP_RANK_MOST; k++) {
        double share = own > 0.0 ? fmin(fmax(other / own, 0.0), 1.0) : 0.0;
        double gain = nearer + share * (2.0 * other - share * own);
        if (gain > most) {
            most = gain;
            fit->rank = k;
            fit->of_rest = 2.0 * share / (1.0 + share);
        }
        if (k == DEEP_RANK_MOST) break;
        nearer += 2.0 * p->other[k] - p->own[k];
        own -= p->own[k];
        other -= p->other[k];
    }
}

/* Adds factor times the retained part of a matrix to out. */
static status add_kept(const struct rank_job *x, const struct deep_rank_fit *fit, float *matrix, double factor,
                       double *out, struct error *err)
{
    status s = take_apart(x, matrix, err);
    for (size_t i = 0; i < x->n_all && s == STATUS_OK; i++) out[i] += factor * fit->of_rest * (double)matrix[i];
    for (size_t v = 0; v < x->t->n_view && s == STATUS_OK; v++)
        for (size_t k = 0; k < fit->rank; k++) {
            double much = factor * (1.0 - fit->of_rest) * along(x, matrix + v * x->n_column, k);
            const float *component = x->component + k * x->n_column;
            for (size_t i = 0; i < x->n_column; i++) out[v * x->n_column + i] += much * (double)component[i];
        }
    return s;
}

/* With the means of both halves in value, and their differences in off: adds the retained part of the rest. */
static status keep(const struct rank_job *x, double *value, double *off, struct deep_rank_fit *fit, struct error *err)
{
    struct products p = {0};
    status s = STATUS_OK;
    for (size_t h = 0; h < 2 && s == STATUS_OK; h++) {
        s = take_apart(x, x->scaled[h], err);
        if (s == STATUS_OK) add_products(x, x->scaled[h], x->scaled[1 - h], &p);
    }
    choose(&p, fit);
    for (size_t h = 0; h < 2 && s == STATUS_OK; h++) s = add_kept(x, fit, x->scaled[h], h == 0 ? 0.5 : -0.5, off, err);
    fit->noise2 = 0.0;
    for (size_t i = 0; i < x->n_all; i++) {
        fit->noise2 += off[i] * off[i];
        off[i] = 0.0;
        x->scaled[0][i] = 0.5f * (x->scaled[0][i] + x->scaled[1][i]);
    }
    if (s == STATUS_OK) s = add_kept(x, fit, x->scaled[0], 1.0, off, err);
    for (size_t i = 0; i < x->n_all; i++) {
        double scale = scale_of(x, i);
        value[i] = scale > 0.0 ? value[i] + off[i] / scale : 0.0;
    }
    return s;
}

status deep_rank_keep(const struct deep_halves *t, struct thread_pool *pool, double *value, struct deep_rank_fit *fit,
                      struct error *err)
{
    struct rank_job x = {.t = t, .n_column = 3 * t->n_light, .n_all = 3 * t->n_light * t->n_view, .pool = pool};
    double *off = calloc(x.n_all + 3 * t->n_view + x.n_column, sizeof *off);
    float *number = malloc((2 * x.n_all + DEEP_RANK_MOST * x.n_column) * sizeof *number);
    status s = STATUS_OK;
    if (off == NULL || number == NULL)
        s = error_set(err, STATUS_NO_MEMORY, "cannot make tables: out of memory");
    else {
        x.scaled[0] = number;
        x.scaled[1] = number + x.n_all;
        x.component = number + 2 * x.n_all;
        memset(value, 0, x.n_all * sizeof *value);
        for (size_t h = 0; h < 2; h++) split(&x, h, off + x.n_all, value, off);
        s = keep(&x, value, off, fit, err);
    }
    free(off);
    free(number);
    return s;
}
