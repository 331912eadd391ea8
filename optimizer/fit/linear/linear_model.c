#include "optimizer/fit/linear/linear_model.h"
#include "optimizer/fit/objective/product_noise.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

status linear_model_init(struct linear_model *m, size_t n_row, size_t n_param, struct error *err)
{
    *m = (struct linear_model){.n_row = n_row, .n_param = n_param};
    size_t per_replica = 2 * n_row + 2 * n_row * n_param;
    double *block = calloc(2 * per_replica + (6 + LINEAR_COLOR_CAUSES) * n_row, sizeof *block);
    m->pair = malloc((n_row / 3 * ESTIMATE_MAX_PARTNER + 1) * sizeof *m->pair);
    m->r[0] = block;
    if (block == NULL || m->pair == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot hold a model of %zu residuals: out of memory", n_row);
    for (size_t q = 0; q < 2; q++) {
        m->r[q] = block + q * per_replica;
        m->r_var[q] = m->r[q] + n_row;
        m->j[q] = m->r_var[q] + n_row;
        m->j_var[q] = m->j[q] + n_row * n_param;
    }
    m->row_var = 1.0;
    m->weight = block + 2 * per_replica;
    m->photograph_var = m->weight + n_row;
    m->extra = m->photograph_var + n_row;
    m->contrast = m->extra + n_row;
    m->color_var = m->contrast + n_row;
    m->color = m->color_var + n_row;
    m->expected = m->color + LINEAR_COLOR_CAUSES * n_row;
    for (size_t row = 0; row < n_row; row++) m->weight[row] = m->extra[row] = 1.0;
    return STATUS_OK;
}

void linear_model_release(struct linear_model *m)
{
    free(m->r[0]);
    free(m->pair);
    *m = (struct linear_model){0};
}

double linear_model_part(const struct linear_model *m, size_t i, double *se)
{
    double value = 0.0, sd = 0.0;
    for (size_t row = 3 * i; row < 3 * i + 3; row++) {
        double ra = m->r[0][row], rb = m->r[1][row], va = m->r_var[0][row], vb = m->r_var[1][row];
        value += ra * rb;
        sd += sqrt(fmax(ra * ra * vb + rb * rb * va - va * vb, va * vb));
    }
    *se = sd;
    return value;
}

static struct product_noise noise_of(const struct linear_model *m, size_t i)
{
    struct product_noise noise = {0};
    for (size_t row = 3 * i; row < 3 * i + 3; row++)
        product_noise_add(&noise, (const double[2]){m->r[0][row], m->r[1][row]},
                          (const double[2]){m->r_var[0][row], m->r_var[1][row]});
    return noise;
}

double linear_model_objective(const struct linear_model *m, double *se)
{
    double value = 0.0, var = 0.0;
    for (size_t i = 0; i < m->n_row / 3; i++) {
        double sd;
        value += linear_model_part(m, i, &sd);
        var += sd * sd;
    }
    for (size_t k = 0; k < m->n_pair; k++) {
        const struct product_noise a = noise_of(m, m->pair[k].i), b = noise_of(m, m->pair[k].j);
        var += 2.0 * product_noise_covariance(&a, &b, m->pair[k].correlation);
    }
    if (se != NULL) *se = sqrt(fmax(var, 0.0));
    return value;
}

double linear_model_weighted_objective(const struct linear_model *m)
{
    double sum = 0.0;
    for (size_t row = 0; row < m->n_row; row++) sum += m->weight[row] * m->r[0][row] * m->r[1][row];
    return sum;
}

double linear_model_row_noise(const struct linear_model *m, size_t row)
{
    return 0.25 * (m->r_var[0][row] + m->r_var[1][row]);
}

/* Variance of a row by tracing and by the photograph's error, without its extra weight, which must not be 0. */
static double known_variance(const struct linear_model *m, size_t row)
{
    return (linear_model_row_noise(m, row) + m->photograph_var[row]) / m->extra[row];
}

enum row_kind { ROWS_OF_MEANS, ROWS_OF_CONTRASTS, ROWS_OF_BOTH };

static bool counts(const struct linear_model *m, size_t row, enum row_kind kind)
{
    return m->extra[row] > 0.0 && !(m->expected[row] > 0.0) &&
           (kind == ROWS_OF_BOTH || (m->contrast[row] > 0.0) == (kind == ROWS_OF_CONTRASTS));
}

/* freedom: degrees of freedom per row. Rows have the weights 1 / variance^power. */
static double misfit_of(const struct linear_model *m, double freedom, enum row_kind kind, int power)
{
    enum { ROUND = 8 };
    double misfit = 0.0, n = 0.0;
    for (size_t i = 0; i < m->n_row / 3; i++) {
        double se;
        if (!counts(m, 3 * i, kind)) continue;
        misfit += linear_model_part(m, i, &se);
        n += 3.0;
    }
    misfit = fmax(misfit, 0.0) / fmax(n, 1.0);
    for (int round = 0; round < ROUND; round++) {
        double sum = 0.0, square = 0.0, photograph = 0.0;
        for (size_t row = 0; row < m->n_row; row++) {
            if (!counts(m, row, kind)) continue;
            double var = misfit + known_variance(m, row) + 1e-12, weight = 1.0 / (power == 2 ? var * var : var);
            square += weight * m->r[0][row] * m->r[1][row] / m->extra[row];
            photograph += weight * (m->photograph_var[row] - m->color_var[row]) / m->extra[row];
            sum += weight;
        }
        misfit = sum > 0.0 ? fmax(0.0, (square / freedom - photograph) / sum) : 0.0;
    }
    return misfit;
}

static double freedom_of_row(const struct linear_model *m, size_t n_free)
{
    double n = 0.0;
    for (size_t row = 0; row < m->n_row; row++) n += counts(m, row, ROWS_OF_BOTH);
    return fmax(1.0, n - (double)n_free) / fmax(1.0, n);
}

double linear_model_misfit(const struct linear_model *m, size_t n_free)
{
    return misfit_of(m, freedom_of_row(m, n_free), ROWS_OF_BOTH, 2);
}

void linear_model_misfits(const struct linear_model *m, size_t n_free, double misfit[2])
{
    double freedom = freedom_of_row(m, n_free);
    misfit[0] = misfit_of(m, freedom, ROWS_OF_MEANS, 1);
    misfit[1] = misfit_of(m, freedom, ROWS_OF_CONTRASTS, 1);
}

void linear_model_weigh(struct linear_model *m, size_t n_free)
{
    double misfit = linear_model_misfit(m, n_free), sum = 0.0, n = 0.0;
    for (size_t row = 0; row < m->n_row; row++) {
        m->weight[row] = m->extra[row] > 0.0 ? 1.0 / fmax(misfit + known_variance(m, row), 1e-6) : 0.0;
        sum += m->weight[row];
        n += m->extra[row] > 0.0;
    }
    double mean = sum > 0.0 ? sum / n : 1.0; /* when no row has information, all weights are 0 */
    for (size_t row = 0; row < m->n_row; row++) m->weight[row] /= mean;
    m->row_var = 1.0 / mean; /* weight x variance, the same for all rows */
}

double linear_model_penalty(const struct linear_model *m, const double *x)
{
    double sum = 0.0;
    for (size_t p = 0; p < m->n_param && m->prior != NULL; p++)
        sum += m->prior[p].precision * (x[p] - m->prior[p].mean) * (x[p] - m->prior[p].mean);
    return m->row_var * sum;
}

void linear_model_gradient(const struct linear_model *m, double *g)
{
    memset(g, 0, m->n_param * sizeof *g);
    for (size_t row = 0; row < m->n_row; row++)
        for (size_t p = 0; p < m->n_param; p++)
            g[p] += m->weight[row] *
                    (m->r[0][row] * m->j[1][row * m->n_param + p] + m->r[1][row] * m->j[0][row * m->n_param + p]);
    for (size_t p = 0; p < m->n_param && m->prior != NULL; p++)
        g[p] += 2.0 * m->row_var * m->prior[p].precision * (m->x_ref[p] - m->prior[p].mean);
}

void linear_model_hessian(const struct linear_model *m, bool cross, double *hessian)
{
    size_t n = m->n_param;
    memset(hessian, 0, n * n * sizeof *hessian);
    for (size_t row = 0; row < m->n_row; row++) {
        const double *a = m->j[0] + row * n, *b = m->j[1] + row * n;
        for (size_t p = 0; p < n; p++)
            for (size_t q = 0; q < n; q++)
                hessian[p * n + q] +=
                    m->weight[row] * (cross ? a[p] * b[q] + b[p] * a[q] : 0.5 * (a[p] + b[p]) * (a[q] + b[q]));
    }
    for (size_t p = 0; p < n && m->prior != NULL; p++) hessian[p * n + p] += 2.0 * m->row_var * m->prior[p].precision;
}

double linear_model_noise(const struct linear_model *m)
{
    double sum = 0.0;
    for (size_t row = 0; row < m->n_row; row++) sum += m->weight[row] * linear_model_row_noise(m, row);
    return sum / (double)m->n_row;
}

double linear_model_mean_noise(const struct linear_model *m)
{
    double sum = 0.0;
    for (size_t row = 0; row < m->n_row; row++) sum += linear_model_row_noise(m, row);
    return sum / (double)m->n_row;
}
