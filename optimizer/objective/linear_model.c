#include "optimizer/objective/linear_model.h"
#include "optimizer/objective/objective.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void linear_history_init(struct linear_history *h, const struct observation_set *o, const struct coordinate *k,
                         size_t n_param)
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

status linear_history_append(struct linear_history *h, const double *x, const struct estimate *a,
                             const struct estimate *b, struct error *err)
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
    for (size_t p = 0; p < h->n_param; p++)
        s->slope[p] = coordinate_slope(&h->coordinate[p], coordinate_to_param(&h->coordinate[p], x[p]));
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
    double *block = calloc(2 * per_replica + 3 * n_row, sizeof *block);
    if (block == NULL)
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
    for (size_t row = 0; row < n_row; row++) m->weight[row] = m->extra[row] = 1.0;
    return STATUS_OK;
}

void linear_model_release(struct linear_model *m)
{
    free(m->r[0]);
    *m = (struct linear_model){0};
}

/* ---- pooling ---- */

/* Paths that noise falls with: the variance of a mean is v / n, that of a contrast of few paths nearer v / n^2. */
static double strength(const struct linear_history *h, size_t i, double n_path)
{
    return observation_is_contrast(&h->observation->item[i]) ? n_path * n_path : n_path;
}

/* v of that, of residuals. */
static double noise_variance(const struct linear_history *h, size_t i)
{
    double sum = 0.0, n = 0.0;
    if (!observation_is_contrast(&h->observation->item[i])) return linear_history_path_variance(h, i);
    for (size_t k = 0; k < h->n_step; k++) {
        for (int q = 0; q < 2; q++) {
            const struct estimate *e = &h->step[k].replica[q][i];
            double paths = (double)e->n_path;
            sum += paths * strength(h, i, paths) * (e->var[0] + e->var[1] + e->var[2]) / 3.0;
            n += paths;
        }
    }
    return n > 0.0 ? objective_weight(&h->observation->item[i]) * sum / n : 0.0;
}

/* Mean derivatives by coordinates over all steps, weighted by paths: n_row x n_param. One set for all steps: measured
 * with its own derivatives, a step that happens to hold a rare bright path would seem farther away, count less, and the
 * mean would come out too dark. */
static void mean_derivatives(const struct linear_history *h, double *mean)
{
    size_t n = h->n_param, n_row = 3 * h->observation->n;
    memset(mean, 0, n_row * n * sizeof *mean);
    for (size_t row = 0; row < n_row; row++) {
        double root_w = sqrt(objective_weight(&h->observation->item[row / 3])), n_path = 0.0;
        for (size_t k = 0; k < h->n_step; k++) {
            for (int q = 0; q < 2; q++) {
                const struct estimate *e = &h->step[k].replica[q][row / 3];
                n_path += (double)e->n_path;
                for (size_t p = 0; p < n; p++)
                    mean[row * n + p] += (double)e->n_path * e->jac[(row % 3) * n + p] * h->step[k].slope[p];
            }
        }
        for (size_t p = 0; p < n; p++) mean[row * n + p] *= n_path > 0.0 ? root_w / n_path : 0.0;
    }
}

/* How far configuration i moves over dx, largest channel. net: square of the predicted change. Along a valley the
 * changes by several parameters cancel, their bends do not: r is the sum over p of (dr/dx_p dx_p^3)^2, j that of
 * (dr/dx_p dx_p)^2. */
struct bend {
    double net, r, j;
};

static void bent_change(const double *mean, size_t i, const double *dx, size_t n, struct bend *out)
{
    *out = (struct bend){0};
    for (size_t row = 3 * i; row < 3 * i + 3; row++) {
        double net = 0.0, r = 0.0, j = 0.0;
        for (size_t p = 0; p < n; p++) {
            double change = mean[row * n + p] * dx[p], square = dx[p] * dx[p];
            net += change;
            j += change * change;
            r += change * change * square * square;
        }
        out->net = fmax(out->net, net * net);
        out->r = fmax(out->r, r);
        out->j = fmax(out->j, j);
    }
}

static void add_derivatives(struct linear_model *m, const struct linear_history *h, const struct history_step *s, int q,
                            size_t i, double weight)
{
    const struct estimate *e = &s->replica[q][i];
    double root_w = sqrt(objective_weight(&h->observation->item[i]));
    for (size_t c = 0; c < 3; c++) {
        double *j = m->j[q] + (3 * i + c) * m->n_param, *j_var = m->j_var[q] + (3 * i + c) * m->n_param;
        for (size_t p = 0; p < m->n_param; p++) {
            double factor = weight * root_w * s->slope[p];
            j[p] += factor * e->jac[c * m->n_param + p];
            j_var[p] += factor * factor * e->jac_var[c * m->n_param + p];
        }
    }
}

/* change: of the mean from the step to x_ref. */
static void add_residuals(struct linear_model *m, const struct linear_history *h, const struct history_step *s, int q,
                          size_t i, const double change[3], double weight)
{
    const struct estimate *e = &s->replica[q][i];
    const struct observation *o = &h->observation->item[i];
    double root_w = sqrt(objective_weight(o));
    for (size_t c = 0; c < 3; c++) {
        m->r[q][3 * i + c] += weight * root_w * (e->mean[c] - o->mean_rgb[c] + change[c]);
        m->r_var[q][3 * i + c] += weight * weight * root_w * root_w * e->var[c];
    }
}

/* Variance of one path's derivatives of configuration i, and the square of the mean derivatives, both summed over
 * columns and channels. */
struct derivative_scale {
    double path_variance, square;
};

static struct derivative_scale derivative_scale(const struct linear_history *h, const double *mean, size_t i)
{
    struct derivative_scale scale = {0};
    double n_path = 0.0, w = objective_weight(&h->observation->item[i]);
    for (size_t k = 0; k < h->n_step; k++) {
        for (int q = 0; q < 2; q++) {
            const struct history_step *s = &h->step[k];
            double n = (double)s->replica[q][i].n_path;
            n_path += n;
            for (size_t p = 0; p < h->n_param; p++)
                for (size_t c = 0; c < 3; c++)
                    scale.path_variance += n * strength(h, i, n) * w * s->slope[p] * s->slope[p] *
                                           s->replica[q][i].jac_var[c * h->n_param + p];
        }
    }
    scale.path_variance = n_path > 0.0 ? scale.path_variance / n_path : 0.0;
    for (size_t j = 3 * i * h->n_param; j < 3 * (i + 1) * h->n_param; j++) scale.square += mean[j] * mean[j];
    return scale;
}

/* Carried means bend to third order, derivatives to first; how much was chosen by trial on analytic cloth, where a
 * factor of four either way made little difference. Without the parts that hide behind cancelling changes, old steps
 * were believed all along a valley: fits ended 3 to 5 % off where noise is 1 %, one in ten. */
static const double bend_r = 64.0, hidden_r = 2.0, bend_j = 16.0, hidden_j = 16.0;

/* Noise of one path of a mean of n. */
static double per_path(const struct linear_history *h, size_t i, size_t k)
{
    double n = (double)h->step[k].replica[0][i].n_path;
    return n > 0.0 ? 1.0 / strength(h, i, n) : INFINITY;
}

static double derivative_weight(const struct linear_history *h, size_t i, size_t k, const struct derivative_scale *scale,
                                const struct bend *change)
{
    return 1.0 / (scale->path_variance * per_path(h, i, k) + bend_j * change->net * scale->square + hidden_j * change->j + 1e-12);
}

struct pool_weight {
    double r, j;
};

/* Weights of all steps for configuration i, summing to 1. */
static void pool_weights(const struct linear_history *h, size_t i, const struct derivative_scale *scale,
                         const struct bend *change, struct pool_weight *weight, double *n_effective)
{
    double path_variance = noise_variance(h, i), sum_r = 0.0, sum_j = 0.0, sum_square = 0.0;
    for (size_t k = 0; k < h->n_step; k++) {
        double net = change[k].net, bend = bend_r * net * net * net + hidden_r * change[k].r;
        weight[k].r = 1.0 / (path_variance * per_path(h, i, k) + bend + 1e-12);
        weight[k].j = derivative_weight(h, i, k, scale, &change[k]);
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

/* Change of the means of configuration i over dx up to x_ref, by the derivatives half way as all steps say them. (Those of
 * the step itself are noisier, and by the same rare paths as its mean.) */
static void carry(const struct linear_history *h, const double *mean, size_t i, const struct derivative_scale *scale,
                  const double *x_ref, const double *dx, double change[2][3])
{
    double sum = 0.0, away[SCATTERING_MAX_PARAM];
    memset(change, 0, 2 * sizeof *change);
    for (size_t k = 0; k < h->n_step; k++) {
        const struct history_step *s = &h->step[k];
        struct bend b;
        for (size_t p = 0; p < h->n_param; p++) away[p] = x_ref[p] - 0.5 * dx[p] - s->x[p];
        bent_change(mean, i, away, h->n_param, &b);
        double weight = derivative_weight(h, i, k, scale, &b);
        sum += weight;
        for (int q = 0; q < 2; q++)
            for (size_t c = 0; c < 3; c++)
                for (size_t p = 0; p < h->n_param; p++)
                    change[q][c] += weight * s->replica[q][i].jac[c * h->n_param + p] * s->slope[p] * dx[p];
    }
    for (int q = 0; q < 2; q++)
        for (size_t c = 0; c < 3; c++) change[q][c] = sum > 0.0 ? change[q][c] / sum : 0.0;
}

static void pool_configuration(struct linear_model *m, const struct linear_history *h, const double *mean, size_t i,
                               struct bend *change, struct pool_weight *weight)
{
    const struct derivative_scale scale = derivative_scale(h, mean, i);
    double dx[SCATTERING_MAX_PARAM], carried[2][3];
    for (size_t k = 0; k < h->n_step; k++) {
        for (size_t p = 0; p < m->n_param; p++) dx[p] = m->x_ref[p] - h->step[k].x[p];
        bent_change(mean, i, dx, m->n_param, &change[k]);
    }
    pool_weights(h, i, &scale, change, weight, &m->n_effective);
    for (size_t k = 0; k < h->n_step; k++) {
        for (size_t p = 0; p < m->n_param; p++) dx[p] = m->x_ref[p] - h->step[k].x[p];
        carry(h, mean, i, &scale, m->x_ref, dx, carried);
        for (int q = 0; q < 2; q++) {
            add_derivatives(m, h, &h->step[k], q, i, weight[k].j);
            add_residuals(m, h, &h->step[k], q, i, carried[q], weight[k].r);
        }
    }
}

/* ---- one gain for each configuration ---- */

static double dot3(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* Unit vector along m, and the share of a row along it that goes: 1 - 1 / sqrt(1 + sd^2 |m|^2 / v). */
static double gain_share(const struct linear_model *m, const struct observation *o, size_t i, double misfit,
                         double unit[3])
{
    double noise = 0.0, root_w = sqrt(objective_weight(o)), length2;
    for (size_t c = 0; c < 3; c++) {
        unit[c] = root_w * o->mean_rgb[c];
        noise += linear_model_row_noise(m, 3 * i + c) / 3.0;
    }
    length2 = dot3(unit, unit);
    if (!(length2 > 0.0) || observation_is_contrast(o)) return 0.0; /* a gain leaves a contrast as it is */
    for (size_t c = 0; c < 3; c++) unit[c] /= sqrt(length2);
    return 1.0 - 1.0 / sqrt(1.0 + m->gain_sd * m->gain_sd * length2 / (misfit + noise));
}

static double absorbed_objective(const struct linear_model *m, const struct observation_set *o, double misfit)
{
    double sum = 0.0;
    for (size_t i = 0; i < o->n; i++) {
        double unit[3], share = gain_share(m, &o->item[i], i, misfit, unit);
        const double *a = m->r[0] + 3 * i, *b = m->r[1] + 3 * i;
        sum += dot3(a, b) + (share * share - 2.0 * share) * dot3(a, unit) * dot3(b, unit);
    }
    return sum;
}

/* v <- v - share unit (unit . v), for three values `stride` apart. */
static void take_out(double *v, size_t stride, const double unit[3], double share)
{
    double along = share * (unit[0] * v[0] + unit[1] * v[stride] + unit[2] * v[2 * stride]);
    for (size_t c = 0; c < 3; c++) v[c * stride] -= along * unit[c];
}

/* Variances of the same: the larger of what independent and what fully correlated channels give. */
static void take_out_var(double *v, size_t stride, const double unit[3], double share)
{
    double old[3] = {v[0], v[stride], v[2 * stride]};
    for (size_t c = 0; c < 3; c++) {
        double apart = 0.0, together = 0.0;
        for (size_t k = 0; k < 3; k++) {
            double factor = (c == k ? 1.0 : 0.0) - share * unit[c] * unit[k];
            apart += factor * factor * old[k];
            together += factor * sqrt(old[k]);
        }
        v[c * stride] = fmax(apart, together * together);
    }
}

static void absorb_gains(struct linear_model *m, const struct observation_set *o)
{
    enum { ROUND = 6 };
    double misfit = fmax(linear_model_objective(m, NULL) / (double)m->n_row, 1e-8);
    for (int round = 0; round < ROUND; round++)
        misfit = fmax(absorbed_objective(m, o, misfit) / (double)m->n_row, 1e-8);
    for (size_t i = 0; i < o->n; i++) {
        double unit[3], share = gain_share(m, &o->item[i], i, misfit, unit);
        for (int q = 0; q < 2; q++) {
            take_out(m->r[q] + 3 * i, 1, unit, share);
            take_out_var(m->r_var[q] + 3 * i, 1, unit, share);
            for (size_t p = 0; p < m->n_param; p++) {
                take_out(m->j[q] + 3 * i * m->n_param + p, m->n_param, unit, share);
                take_out_var(m->j_var[q] + 3 * i * m->n_param + p, m->n_param, unit, share);
            }
        }
    }
}

status linear_model_pool(struct linear_model *m, const struct linear_history *h, const double *x_ref, struct error *err)
{
    status s = STATUS_OK;
    double *mean = malloc(m->n_row * m->n_param * sizeof *mean);
    struct bend *change = malloc(h->n_step * sizeof *change);
    struct pool_weight *weight = malloc(h->n_step * sizeof *weight);
    if (mean == NULL || weight == NULL || change == NULL) {
        s = error_set(err, STATUS_NO_MEMORY, "cannot average estimates: out of memory");
        goto out;
    }
    memset(m->r[0], 0, 4 * (m->n_row + m->n_row * m->n_param) * sizeof(double)); /* all eight arrays: one block */
    memcpy(m->x_ref, x_ref, m->n_param * sizeof *x_ref);
    mean_derivatives(h, mean);
    m->n_effective = 0.0;
    for (size_t i = 0; i < h->observation->n; i++)
        pool_configuration(m, h, mean, i, change, weight);
    for (size_t row = 0; row < m->n_row; row++) {
        m->photograph_var[row] = objective_photograph_variance(&h->observation->item[row / 3], row % 3);
        m->extra[row] = h->observation->item[row / 3].weight;
    }
    m->n_effective /= (double)h->observation->n;
    if (m->gain_sd > 0.0) absorb_gains(m, h->observation);
out:
    free(mean);
    free(change);
    free(weight);
    return s;
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

/* Variance by tracing and photograph, without the extra weight, which is not 0. */
static double known_variance(const struct linear_model *m, size_t row)
{
    return (linear_model_row_noise(m, row) + m->photograph_var[row]) / m->extra[row];
}

double linear_model_misfit(const struct linear_model *m, size_t n_free)
{
    enum { ROUND = 8 };
    double n = 0.0, misfit = fmax(linear_model_objective(m, NULL), 0.0) / (double)m->n_row;
    for (size_t row = 0; row < m->n_row; row++) n += m->extra[row] > 0.0;
    double freedom = fmax(1.0, n - (double)n_free) / fmax(1.0, n);
    for (int round = 0; round < ROUND; round++) {
        double sum = 0.0, square = 0.0, photograph = 0.0;
        for (size_t row = 0; row < m->n_row; row++) {
            if (!(m->extra[row] > 0.0)) continue;
            double var = misfit + known_variance(m, row) + 1e-12, weight = 1.0 / (var * var);
            square += weight * m->r[0][row] * m->r[1][row] / m->extra[row];
            photograph += weight * m->photograph_var[row] / m->extra[row];
            sum += weight;
        }
        misfit = sum > 0.0 ? fmax(0.0, (square / freedom - photograph) / sum) : 0.0;
    }
    return misfit;
}

void linear_model_weigh(struct linear_model *m, size_t n_free)
{
    double misfit = linear_model_misfit(m, n_free), sum = 0.0, n = 0.0;
    for (size_t row = 0; row < m->n_row; row++) {
        m->weight[row] = m->extra[row] > 0.0 ? 1.0 / fmax(misfit + known_variance(m, row), 1e-6) : 0.0;
        sum += m->weight[row];
        n += m->extra[row] > 0.0;
    }
    double mean = sum > 0.0 ? sum / n : 1.0; /* no row says anything: all weights 0 */
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
