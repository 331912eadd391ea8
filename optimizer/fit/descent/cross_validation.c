#include "optimizer/fit/descent/cross_validation.h"
#include "optimizer/fit/baseline/discrepancy_fit.h"
#include "optimizer/fit/descent/bounded_quadratic.h"
#include "optimizer/fit/objective/folds.h"
#include "optimizer/fit/objective/objective.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N = FIT_MAX_PARAM };

/* Largest move of a parameter when a fold is left out, in step limits: within it the linear model means something. */
static const double reach = 4.0;
/* Shares of the discrepancy that are tried: 0, 1 / SHARES, ..., 1. */
enum { SHARES = 20 };

/* A number of the rows, predicted by a fit without it. */
struct left_out {
    double r[2];       /* residuals of both replicas, without the extra weight */
    double log_factor; /* of the discrepancy of the fit without the number, with the share 1 */
    double measured;   /* in units of the objective */
};

static bool scored(const struct linear_model *m, size_t i)
{
    return m->extra[3 * i] > 0.0 && !(m->contrast[3 * i] > 0.0) && !(m->expected[3 * i] > 0.0);
}

/* A fit without the rows of one fold: the free parameters in step limits. */
struct fold_fit {
    struct linear_model part; /* m with weights and residuals of its own */
    double *own;              /* these: n_row weights, then the residuals of both replicas */
    size_t n, index[N];
    double h[N * N], g[N], lower[N], upper[N];
    bool discrepancy;
    struct discrepancy_row *row; /* working memory for all rows */
    struct left_out *left_out;   /* n_row, in the order of the rows */
};

/* Fills in the quadratic model of all rows that `part` weighs. residual_var: variance of a weighted residual. */
static void quadratic_model(struct fold_fit *f, const struct coordinate *k, double residual_var)
{
    double h[N * N], g[N];
    const size_t n_param = f->part.n_param;
    linear_model_hessian(&f->part, false, h);
    linear_model_gradient(&f->part, g);
    for (size_t a = 0; a < f->n; a++) {
        const size_t p = f->index[a];
        const double limit = k[p].step_limit, range = (k[p].upper - k[p].lower) / limit;
        for (size_t b = 0; b < f->n; b++)
            f->h[a * f->n + b] = h[p * n_param + f->index[b]] * limit * k[f->index[b]].step_limit;
        f->h[a * f->n + a] += 2.0 * residual_var * 12.0 / (range * range);
        f->g[a] = g[p] * limit;
        f->lower[a] = fmin(0.0, fmax(-reach, (k[p].lower - f->part.x_ref[p]) / limit));
        f->upper[a] = fmax(0.0, fmin(reach, (k[p].upper - f->part.x_ref[p]) / limit));
    }
}

/* The residuals that both replicas predict for one row after a move dx, without its extra weight. */
static void predict(const struct linear_model *m, size_t row, const double *dx, double r[2])
{
    for (int q = 0; q < 2; q++) {
        r[q] = m->r[q][row];
        for (size_t p = 0; p < m->n_param; p++) r[q] += m->j[q][row * m->n_param + p] * dx[p];
        r[q] /= sqrt(m->extra[row]);
    }
}

/* The discrepancy of observation i, which is rendered as the fit after a move dx predicts. */
static void predicted_row(const struct linear_model *m, const struct observation *o, size_t i, const double *dx,
                          struct discrepancy_row *row)
{
    double rendered[3], r[2];
    for (size_t c = 0; c < 3; c++) {
        predict(m, 3 * i + c, dx, r);
        rendered[c] = o->mean_rgb[c] + 0.5 * (r[0] + r[1]) / sqrt(objective_relative_weight(o));
    }
    discrepancy_row_of(o, rendered, row);
}

/* Fills in the log_factor of the rows of a fold by the discrepancy of all others. */
static status predict_discrepancy(const struct linear_model *m, const struct observation_set *o, const size_t *fold,
                                  size_t i_fold, const double *dx, struct fold_fit *f, struct error *err)
{
    struct discrepancy *d = malloc(sizeof *d);
    size_t n = 0;
    if (d == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot cross-validate %zu rows: out of memory", o->n);
    for (size_t i = 0; i < o->n; i++)
        if (fold[i] != i_fold && scored(m, i) && discrepancy_applies(&o->item[i]))
            predicted_row(m, &o->item[i], i, dx, &f->row[n++]);
    status s = discrepancy_fit(f->row, n, 1.0, d, err);
    for (size_t i = 0; i < o->n && s == STATUS_OK; i++) {
        double log_rgb[3];
        if (fold[i] != i_fold || !scored(m, i) || !discrepancy_applies(&o->item[i])) continue;
        predicted_row(m, &o->item[i], i, dx, &f->row[n]);
        discrepancy_log_factor(d, f->row[n].place, log_rgb);
        for (size_t c = 0; c < 3; c++) f->left_out[3 * i + c].log_factor = log_rgb[c];
    }
    free(d);
    return s;
}

/* Product of the residuals of both replicas with a share of the discrepancy. */
static double square_with(const struct left_out *l, double share)
{
    const double factor = exp(fmin(fmax(share * l->log_factor, -DISCREPANCY_MOST), DISCREPANCY_MOST));
    const double more = l->measured * (factor - 1.0);
    return (l->r[0] * factor + more) * (l->r[1] * factor + more);
}

/* Sums up the folds with a share of the discrepancy, and returns the sum of all. */
static double sum_folds(const struct linear_model *m, const struct fold_fit *f, const size_t *fold, double share,
                        struct cross_validation *out)
{
    double sum = 0.0;
    memset(out->fold_square, 0, sizeof out->fold_square);
    memset(out->fold_count, 0, sizeof out->fold_count);
    for (size_t row = 0; row < m->n_row; row++) {
        if (!scored(m, row / 3)) continue;
        const double square = square_with(&f->left_out[row], share);
        out->fold_square[fold[row / 3]] += square;
        out->fold_count[fold[row / 3]] += 1.0;
        sum += square;
    }
    return sum;
}

/* Finds the share, and leaves the folds' sums with it. */
static void choose_share(const struct linear_model *m, const struct fold_fit *f, const size_t *fold,
                         struct cross_validation *out)
{
    double least = sum_folds(m, f, fold, 0.0, out), n = 0.0;
    for (size_t i = 0; i < FOLDS_MAX; i++) n += out->fold_count[i];
    out->plain_rel_rms = sqrt(fmax(0.0, least / n));
    if (!f->discrepancy) return;
    for (size_t k = 1; k <= SHARES; k++) {
        const double share = (double)k / SHARES, sum = sum_folds(m, f, fold, share, out);
        if (!(sum < least)) continue;
        least = sum;
        out->discrepancy_share = share;
    }
    sum_folds(m, f, fold, out->discrepancy_share, out);
}

/* Fills in weights and residuals of a fold. Radiances that are expected between the rows are predicted from the rows
 * outside the fold only. */
static void own_rows(const struct linear_model *m, const struct observation_set *o, const size_t *fold, size_t i_fold,
                     struct fold_fit *f)
{
    for (size_t row = 0; row < m->n_row; row++) {
        const struct observation *item = &o->item[row / 3];
        f->part.weight[row] = fold[row / 3] == i_fold ? 0.0 : m->weight[row];
        double shift = 0.0;
        if (item->expected)
            shift = sqrt(objective_weight(item)) * (item->mean_rgb[row % 3] - item->left_out_rgb[3 * i_fold + row % 3]);
        for (size_t q = 0; q < 2; q++) f->part.r[q][row] = m->r[q][row] + shift;
    }
}

static status leave_out(const struct linear_model *m, const struct observation_set *o, const struct coordinate *k,
                        const size_t *fold, size_t i_fold, struct fold_fit *f, struct error *err)
{
    double y[N], dx[N] = {0};
    own_rows(m, o, fold, i_fold, f);
    quadratic_model(f, k, fmax(linear_model_weighted_objective(m), 0.0) / (double)m->n_row + linear_model_noise(m));
    status s = bounded_quadratic(f->h, f->g, f->lower, f->upper, f->n, y, err);
    if (s != STATUS_OK) return s;
    for (size_t a = 0; a < f->n; a++) dx[f->index[a]] = y[a] * k[f->index[a]].step_limit;
    for (size_t row = 0; row < m->n_row; row++) {
        const struct observation *item = &o->item[row / 3];
        struct left_out *l = &f->left_out[row];
        if (fold[row / 3] != i_fold || !scored(m, row / 3)) continue;
        predict(m, row, dx, l->r);
        l->measured = sqrt(objective_relative_weight(item)) * item->mean_rgb[row % 3];
    }
    return f->discrepancy ? predict_discrepancy(m, o, fold, i_fold, dx, f, err) : STATUS_OK;
}

/* Standard error of the mean of sums `square` over counts `count`, by their scatter. */
static double scatter_of_mean(const double *square, const double *count, size_t n_fold, double mean)
{
    double sum = 0.0, n = 0.0;
    for (size_t f = 0; f < n_fold; f++) {
        double off = square[f] - count[f] * mean;
        sum += off * off;
        n += count[f];
    }
    return sqrt(sum * (double)n_fold / ((double)n_fold - 1.0)) / n;
}

static void summarise(size_t n_fold, struct cross_validation *out)
{
    double sum = 0.0, n = 0.0;
    for (size_t f = 0; f < n_fold; f++) {
        sum += out->fold_square[f];
        n += out->fold_count[f];
    }
    out->n_fold = n_fold;
    out->n_row = (size_t)n / 3;
    out->rel_square = sum / n;
    out->rel_rms = sqrt(fmax(0.0, out->rel_square));
    double se = scatter_of_mean(out->fold_square, out->fold_count, n_fold, out->rel_square);
    out->rel_rms_se = out->rel_rms > 0.0 ? fmin(sqrt(se), 0.5 * se / out->rel_rms) : sqrt(se);
}

/* Whether the rows outside each fold have more numbers than there are free parameters. */
static bool enough_rows(const struct linear_model *m, const size_t *fold, size_t n_fold, size_t n_free)
{
    size_t all = 0, largest = 0, in_fold[FOLDS_MAX] = {0};
    for (size_t i = 0; i < m->n_row / 3; i++) {
        if (!scored(m, i)) continue;
        all += 3;
        in_fold[fold[i]] += 3;
    }
    for (size_t f = 0; f < n_fold; f++) largest = in_fold[f] > largest ? in_fold[f] : largest;
    return n_fold >= FOLDS_LEAST && all - largest > n_free;
}

status cross_validation_compute(const struct linear_model *m, const struct observation_set *o,
                                const struct coordinate *k, const bool *fixed, bool discrepancy,
                                struct cross_validation *out, struct error *err)
{
    struct fold_fit f = {.part = *m, .discrepancy = discrepancy};
    status s = STATUS_OK;
    size_t *fold = malloc(o->n * sizeof *fold);
    f.own = malloc(3 * m->n_row * sizeof *f.own);
    f.row = malloc((o->n + 1) * sizeof *f.row);
    f.left_out = calloc(m->n_row + 1, sizeof *f.left_out);
    memset(out, 0, sizeof *out);
    if (fold == NULL || f.own == NULL || f.row == NULL || f.left_out == NULL) {
        s = error_set(err, STATUS_NO_MEMORY, "cannot cross-validate %zu rows: out of memory", o->n);
        goto out;
    }
    f.part.weight = f.own;
    for (size_t q = 0; q < 2; q++) f.part.r[q] = f.own + (1 + q) * m->n_row;
    for (size_t p = 0; p < m->n_param; p++)
        if (!fixed[p]) f.index[f.n++] = p;
    const size_t n_fold = folds_deal(o, fold);
    if (!enough_rows(m, fold, n_fold, f.n)) goto out;
    for (size_t i = 0; i < n_fold && s == STATUS_OK; i++) s = leave_out(m, o, k, fold, i, &f, err);
    if (s != STATUS_OK) goto out;
    choose_share(m, &f, fold, out);
    summarise(n_fold, out);
out:
    free(f.left_out);
    free(f.row);
    free(f.own);
    free(fold);
    return s;
}

double cross_validation_difference(const struct cross_validation *a, const struct cross_validation *b, double *se)
{
    double square[FOLDS_MAX];
    for (size_t f = 0; f < a->n_fold; f++) square[f] = b->fold_square[f] - a->fold_square[f];
    *se = scatter_of_mean(square, a->fold_count, a->n_fold, b->rel_square - a->rel_square);
    return b->rel_square - a->rel_square;
}
