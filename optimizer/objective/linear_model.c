#include "optimizer/objective/linear_model.h"
#include "optimizer/objective/objective.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void linear_history_init(struct linear_history *h, const struct observation_set *o, const struct coordinate *k, size_t n_param)
{
    *h = (struct linear_history){.observation = o, .coordinate = k, .n_param = n_param};
}

void linear_history_release(struct linear_history *h)
{
    for (size_t i = 0; i < h->n_step; i++) {
        free(h->step[i].replica[0]);
        free(h->step[i].replica[1]);
    }
    free(h->step);
    h->step = NULL;
    h->n_step = h->capacity = 0;
}

status linear_history_append(struct linear_history *h, const double *x, const struct estimate *a, const struct estimate *b,
                             struct error *err)
{
    if (h->n_step == h->capacity) {
        size_t capacity = h->capacity > 0 ? 2 * h->capacity : 32;
        struct history_step *grown = realloc(h->step, capacity * sizeof *grown);
        if (grown == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot keep the estimates of a fit: out of memory");
        h->step = grown;
        h->capacity = capacity;
    }
    struct history_step *s = &h->step[h->n_step];
    size_t n = h->observation->n;
    s->replica[0] = malloc(n * sizeof *a);
    s->replica[1] = malloc(n * sizeof *b);
    if (s->replica[0] == NULL || s->replica[1] == NULL) {
        free(s->replica[0]);
        free(s->replica[1]);
        return error_set(err, STATUS_NO_MEMORY, "cannot keep the estimates of a fit: out of memory");
    }
    memcpy(s->x, x, h->n_param * sizeof *x);
    memcpy(s->replica[0], a, n * sizeof *a);
    memcpy(s->replica[1], b, n * sizeof *b);
    h->n_step++;
    return STATUS_OK;
}

double linear_history_path_variance(const struct linear_history *h, size_t i)
{
    double sum = 0.0, n = 0.0;
    for (size_t k = 0; k < h->n_step; k++) {
        for (int q = 0; q < 2; q++) {
            const struct estimate *e = &h->step[k].replica[q][i];
            if (e->n_path == 0) continue;
            double paths = (double)e->n_path;
            /* weighted by paths: var is itself an estimate, the more paths the better */
            sum += paths * paths * (e->var[0] + e->var[1] + e->var[2]) / 3.0;
            n += paths;
        }
    }
    return n > 0.0 ? objective_weight(&h->observation->item[i]) * sum / n : 0.0;
}

status linear_model_init(struct linear_model *m, size_t n_row, size_t n_param, struct error *err)
{
    *m = (struct linear_model){.n_row = n_row, .n_param = n_param};
    size_t per_replica = 2 * n_row + 2 * n_row * n_param;
    double *block = calloc(2 * per_replica, sizeof *block);
    if (block == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot hold a model of %zu residuals: out of memory", n_row);
    for (size_t q = 0; q < 2; q++) {
        m->r[q] = block + q * per_replica;
        m->r_var[q] = m->r[q] + n_row;
        m->j[q] = m->r_var[q] + n_row;
        m->j_var[q] = m->j[q] + n_row * n_param;
    }
    return STATUS_OK;
}

void linear_model_release(struct linear_model *m)
{
    free(m->r[0]);
    *m = (struct linear_model){0};
}

/* ---- pooling ---- */

/* Predicted mean squared change of a residual between step s and x_ref, by the derivatives of both replicas there. */
static double squared_change(const struct linear_history *h, const struct history_step *s, const double *dx)
{
    double sum = 0.0;
    for (size_t i = 0; i < h->observation->n; i++) {
        double w = objective_weight(&h->observation->item[i]);
        for (size_t c = 0; c < 3; c++) {
            double change = 0.0;
            for (size_t p = 0; p < h->n_param; p++) {
                double slope = coordinate_slope(&h->coordinate[p], coordinate_to_param(&h->coordinate[p], s->x[p]));
                for (int q = 0; q < 2; q++) change += 0.5 * s->replica[q][i].jac[c * h->n_param + p] * slope * dx[p];
            }
            sum += w * change * change;
        }
    }
    return sum / (3.0 * (double)h->observation->n);
}

static void accumulate(struct linear_model *m, const struct linear_history *h, const struct history_step *s, int q, size_t i,
                       const double *dx, const double *slope, double weight_r, double weight_j)
{
    const struct estimate *e = &s->replica[q][i];
    const struct observation *o = &h->observation->item[i];
    double root_w = sqrt(objective_weight(o));
    for (size_t c = 0; c < 3; c++) {
        size_t row = 3 * i + c;
        double r = e->mean[c] - o->mean_rgb[c], var = e->var[c];
        for (size_t p = 0; p < m->n_param; p++) {
            double j = e->jac[c * m->n_param + p] * slope[p], j_var = e->jac_var[c * m->n_param + p] * slope[p] * slope[p];
            r += j * dx[p];
            var += j_var * dx[p] * dx[p];
            m->j[q][row * m->n_param + p] += weight_j * root_w * j;
            m->j_var[q][row * m->n_param + p] += weight_j * weight_j * root_w * root_w * j_var;
        }
        m->r[q][row] += weight_r * root_w * r;
        m->r_var[q][row] += weight_r * weight_r * root_w * root_w * var;
    }
}

struct pool_weight {
    double r, j;
};

/* Weights of all steps for configuration i, summing to 1. Derivatives are noisier by about j_noise and bend to first order. */
static void pool_weights(const struct linear_history *h, size_t i, const double *change2, struct pool_weight *weight,
                         double *n_effective)
{
    const double j_noise = 9.0;
    double path_variance = linear_history_path_variance(h, i), sum_r = 0.0, sum_j = 0.0, sum_square = 0.0;
    for (size_t k = 0; k < h->n_step; k++) {
        double n = (double)h->step[k].replica[0][i].n_path;
        double noise = n > 0.0 ? path_variance / n + 1e-12 : INFINITY;
        weight[k].r = 1.0 / (noise + change2[k] * change2[k]);
        weight[k].j = 1.0 / (j_noise * noise + change2[k]);
        sum_r += weight[k].r;
        sum_j += weight[k].j;
    }
    for (size_t k = 0; k < h->n_step; k++) {
        weight[k].r = sum_r > 0.0 ? weight[k].r / sum_r : 0.0;
        weight[k].j = sum_j > 0.0 ? weight[k].j / sum_j : 0.0;
        double n = (double)h->step[k].replica[0][i].n_path;
        if (n > 0.0) sum_square += weight[k].r * weight[k].r / n;
    }
    *n_effective += sum_square > 0.0 ? 1.0 / sum_square : 0.0;
}

void linear_model_pool(struct linear_model *m, const struct linear_history *h, const double *x_ref)
{
    enum { MAX_STEP = 4096 };
    size_t first = h->n_step > MAX_STEP ? h->n_step - MAX_STEP : 0;
    struct linear_history recent = *h;
    recent.step += first;
    recent.n_step -= first;
    double change2[MAX_STEP];
    struct pool_weight weight[MAX_STEP];
    size_t n_block = 2 * (2 * m->n_row + 2 * m->n_row * m->n_param);
    memset(m->r[0], 0, n_block * sizeof(double));
    memcpy(m->x_ref, x_ref, m->n_param * sizeof *x_ref);
    for (size_t k = 0; k < recent.n_step; k++) {
        double dx[SCATTERING_MAX_PARAM];
        for (size_t p = 0; p < m->n_param; p++) dx[p] = x_ref[p] - recent.step[k].x[p];
        change2[k] = squared_change(&recent, &recent.step[k], dx);
    }
    m->n_effective = 0.0;
    for (size_t i = 0; i < h->observation->n; i++) {
        pool_weights(&recent, i, change2, weight, &m->n_effective);
        for (size_t k = 0; k < recent.n_step; k++) {
            double dx[SCATTERING_MAX_PARAM], slope[SCATTERING_MAX_PARAM];
            for (size_t p = 0; p < m->n_param; p++) {
                dx[p] = x_ref[p] - recent.step[k].x[p];
                slope[p] = coordinate_slope(&h->coordinate[p], coordinate_to_param(&h->coordinate[p], recent.step[k].x[p]));
            }
            for (int q = 0; q < 2; q++) accumulate(m, &recent, &recent.step[k], q, i, dx, slope, weight[k].r, weight[k].j);
        }
    }
    m->n_effective /= (double)h->observation->n;
}

/* ---- what follows from the model ---- */

double linear_model_objective(const struct linear_model *m, double *se)
{
    double value = 0.0, var = 0.0;
    for (size_t i = 0; i < m->n_row / 3; i++) {
        double sd = 0.0;
        for (size_t row = 3 * i; row < 3 * i + 3; row++) {
            double ra = m->r[0][row], rb = m->r[1][row], va = m->r_var[0][row], vb = m->r_var[1][row];
            value += ra * rb;
            sd += sqrt(fmax(ra * ra * vb + rb * rb * va - va * vb, va * vb));
        }
        var += sd * sd;
    }
    if (se != NULL) *se = sqrt(var);
    return value;
}

void linear_model_gradient(const struct linear_model *m, double *g)
{
    memset(g, 0, m->n_param * sizeof *g);
    for (size_t row = 0; row < m->n_row; row++)
        for (size_t p = 0; p < m->n_param; p++)
            g[p] += m->r[0][row] * m->j[1][row * m->n_param + p] + m->r[1][row] * m->j[0][row * m->n_param + p];
}

void linear_model_hessian(const struct linear_model *m, bool cross, double *hessian)
{
    size_t n = m->n_param;
    memset(hessian, 0, n * n * sizeof *hessian);
    for (size_t row = 0; row < m->n_row; row++) {
        const double *a = m->j[0] + row * n, *b = m->j[1] + row * n;
        for (size_t p = 0; p < n; p++)
            for (size_t q = 0; q < n; q++)
                hessian[p * n + q] += cross ? a[p] * b[q] + b[p] * a[q] : 0.5 * (a[p] + b[p]) * (a[q] + b[q]);
    }
}

double linear_model_noise(const struct linear_model *m)
{
    double sum = 0.0;
    for (size_t row = 0; row < m->n_row; row++) sum += 0.25 * (m->r_var[0][row] + m->r_var[1][row]);
    return sum / (double)m->n_row;
}
