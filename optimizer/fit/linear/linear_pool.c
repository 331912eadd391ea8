/* Averages of a fit's estimates at one point: linear_model_pool. */
#include "optimizer/fit/linear/linear_gain.h"
#include "optimizer/fit/objective/objective.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The number by which noise falls: the variance of a mean is v / n, the variance of a contrast of few paths is nearer
 * to v / n^2. */
static double strength(const struct linear_history *h, size_t i, double n_path)
{
    return observation_is_contrast(&h->observation->item[i]) ? n_path * n_path : n_path;
}

/* The v of these formulas, for residuals. */
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

/* Writes the mean derivatives by coordinates over all steps, weighted by paths, to mean (n_row x n_param). All steps
 * use this one set: with its own derivatives, a step that contains a rare bright path would seem farther away and
 * count less, and the mean would be too dark. */
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

/* How much the residuals of configuration i change over dx, in the channel that changes most. net: square of the
 * predicted change. Along a valley the changes by several parameters cancel, but their bends do not: r is the sum over
 * p of (dr/dx_p dx_p^3)^2, and j the sum of (dr/dx_p dx_p)^2. */
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

/* Adds the residuals of a step. change: change of the mean from the step to x_ref. */
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

/* Variance of one path's derivatives of configuration i, by channel and column and summed over both, and the square
 * of the mean derivatives, summed likewise. */
struct derivative_scale {
    double by[3][FIT_MAX_PARAM];
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
                    scale.by[c][p] += n * strength(h, i, n) * w * s->slope[p] * s->slope[p] *
                                      s->replica[q][i].jac_var[c * h->n_param + p];
        }
    }
    for (size_t c = 0; c < 3; c++)
        for (size_t p = 0; p < h->n_param; p++) {
            scale.by[c][p] = n_path > 0.0 ? scale.by[c][p] / n_path : 0.0;
            scale.path_variance += scale.by[c][p];
        }
    for (size_t j = 3 * i * h->n_param; j < 3 * (i + 1) * h->n_param; j++) scale.square += mean[j] * mean[j];
    return scale;
}

/* Means that were carried to x_ref have errors of third order, derivatives of first order. The factors were chosen by
 * trial on analytic cloth, where a factor of four either way made little difference. Without the hidden parts, which
 * cancelling changes conceal, old steps counted fully all along a valley, and one fit in ten ended 3 to 5 % off where
 * the noise is 1 %. */
static const double bend_r = 64.0, hidden_r = 2.0, bend_j = 16.0, hidden_j = 16.0;

/* Noise per path of a mean of n paths. */
static double per_path(const struct linear_history *h, size_t i, size_t k)
{
    double n = (double)h->step[k].replica[0][i].n_path;
    return n > 0.0 ? 1.0 / strength(h, i, n) : INFINITY;
}

static double derivative_weight(const struct linear_history *h, size_t i, size_t k,
                                const struct derivative_scale *scale, const struct bend *change)
{
    return 1.0 / (scale->path_variance * per_path(h, i, k) + bend_j * change->net * scale->square +
                  hidden_j * change->j + 1e-12);
}

/* How a step is carried to x_ref: dx, its size, the change of the means by the derivatives of all steps, and the
 * inverse of the paths of these (1 / strength). */
struct carried {
    double dx[FIT_MAX_PARAM], change[2][3], per_path;
    struct bend bend;
};

/* Carries a step by derivatives half way; derivatives near the middle count most. The derivatives of the step itself
 * are noisier, and their noise comes from the same rare paths as the noise of its mean. */
static void carry(const struct linear_history *h, const double *mean, size_t i, const struct derivative_scale *scale,
                  const double *x_ref, const double *x, struct carried *out)
{
    double sum = 0.0, away[FIT_MAX_PARAM];
    memset(out, 0, sizeof *out);
    for (size_t p = 0; p < h->n_param; p++) out->dx[p] = x_ref[p] - x[p];
    bent_change(mean, i, out->dx, h->n_param, &out->bend);
    for (size_t k = 0; k < h->n_step; k++) {
        const struct history_step *s = &h->step[k];
        struct bend b;
        if (s->replica[0][i].n_path == 0) continue;
        for (size_t p = 0; p < h->n_param; p++) away[p] = x_ref[p] - 0.5 * out->dx[p] - s->x[p];
        bent_change(mean, i, away, h->n_param, &b);
        double weight = derivative_weight(h, i, k, scale, &b);
        sum += weight;
        out->per_path += weight * weight * per_path(h, i, k);
        for (int q = 0; q < 2; q++)
            for (size_t c = 0; c < 3; c++)
                for (size_t p = 0; p < h->n_param; p++)
                    out->change[q][c] += weight * s->replica[q][i].jac[c * h->n_param + p] * s->slope[p] * out->dx[p];
    }
    if (!(sum > 0.0)) return;
    out->per_path /= sum * sum;
    for (int q = 0; q < 2; q++)
        for (size_t c = 0; c < 3; c++) out->change[q][c] /= sum;
}

/* Variance of the change over dx caused by the noise of the derivatives. */
static double change_variance(const struct derivative_scale *scale, size_t c, const double *dx, size_t n,
                              double per_path)
{
    double sum = 0.0;
    for (size_t p = 0; p < n; p++) sum += dx[p] * dx[p] * scale->by[c][p];
    return sum * per_path;
}

struct pool_weight {
    double r, j;
};

/* Weights of all steps for configuration i, summing to 1. */
static void pool_weights(const struct linear_history *h, size_t i, const struct derivative_scale *scale,
                         const struct carried *carried, struct pool_weight *weight, double *n_effective)
{
    double path_variance = noise_variance(h, i), sum_r = 0.0, sum_j = 0.0, sum_square = 0.0;
    for (size_t k = 0; k < h->n_step; k++) {
        const struct carried *way = &carried[k];
        double net = way->bend.net, bend = bend_r * net * net * net + hidden_r * way->bend.r, noise = 0.0;
        for (size_t c = 0; c < 3; c++) noise += change_variance(scale, c, way->dx, h->n_param, way->per_path) / 3.0;
        weight[k].r = 1.0 / (path_variance * per_path(h, i, k) + noise + bend + 1e-12);
        weight[k].j = derivative_weight(h, i, k, scale, &way->bend);
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

/* Adds the noise of the derivatives that carried the steps. All steps use the same derivatives, so these errors add up
 * like the errors of a single step that is carried over the mean of their distances. */
static void add_carried_noise(struct linear_model *m, const struct linear_history *h, size_t i,
                              const struct derivative_scale *scale, const struct carried *carried,
                              const struct pool_weight *weight)
{
    double dx[FIT_MAX_PARAM] = {0}, per_path = 0.0;
    for (size_t k = 0; k < h->n_step; k++) {
        per_path += weight[k].r * carried[k].per_path;
        for (size_t p = 0; p < h->n_param; p++) dx[p] += weight[k].r * carried[k].dx[p];
    }
    for (size_t c = 0; c < 3; c++) {
        double var = change_variance(scale, c, dx, h->n_param, per_path);
        for (int q = 0; q < 2; q++) m->r_var[q][3 * i + c] += var;
    }
}

static void pool_configuration(struct linear_model *m, const struct linear_history *h, const double *mean, size_t i,
                               struct carried *carried, struct pool_weight *weight)
{
    const struct derivative_scale scale = derivative_scale(h, mean, i);
    for (size_t k = 0; k < h->n_step; k++) carry(h, mean, i, &scale, m->x_ref, h->step[k].x, &carried[k]);
    pool_weights(h, i, &scale, carried, weight, &m->n_effective);
    for (size_t k = 0; k < h->n_step; k++) {
        for (int q = 0; q < 2; q++) {
            add_derivatives(m, h, &h->step[k], q, i, weight[k].j);
            add_residuals(m, h, &h->step[k], q, i, carried[k].change[q], weight[k].r);
        }
    }
    add_carried_noise(m, h, i, &scale, carried, weight);
}

/* Sets the photographs' stated errors, in the unit of the residuals. No error of colors changes a contrast much, which
 * is relative to the mean. */
static void set_photograph(struct linear_model *m, const struct observation *o, size_t row)
{
    const size_t c = row % 3;
    const bool contrast = observation_is_contrast(o);
    double *color = m->color + row * LINEAR_COLOR_CAUSES;
    memset(color, 0, LINEAR_COLOR_CAUSES * sizeof *color);
    m->color_var[row] = 0.0;
    for (size_t cause = 0; cause < PHOTOGRAPH_CAUSES && !contrast; cause++) {
        color[cause] = sqrt(objective_weight(o)) * o->photograph.color_error[c][cause];
        m->color_var[row] += color[cause] * color[cause];
    }
    m->photograph_var[row] = objective_photograph_variance(o, c);
    m->color_var[row] = fmin(m->color_var[row], m->photograph_var[row]);
    m->extra[row] = o->weight;
    m->contrast[row] = contrast ? 1.0 : 0.0;
    m->expected[row] = o->expected ? 1.0 : 0.0;
}

/* Adds the partners of configuration i in one estimate to the pairs that begin at `first`. */
static void add_partners(struct linear_model *m, size_t first, size_t i, const struct estimate *e)
{
    for (uint32_t k = 0; k < e->n_partner; k++) {
        size_t p = first;
        while (p < m->n_pair && m->pair[p].j != e->partner[k].configuration) p++;
        if (p == first + ESTIMATE_MAX_PARTNER) continue; /* cannot happen: all estimates have the same partners */
        if (p == m->n_pair) m->pair[m->n_pair++] = (struct linear_pair){i, e->partner[k].configuration, 0.0};
        m->pair[p].correlation += (double)e->n_path * (double)e->partner[k].correlation;
    }
}

/* Fills in m->pair, rows that share their camera paths: correlations as means over all estimates, weighted by their
 * paths. */
static void pool_pairs(struct linear_model *m, const struct linear_history *h)
{
    m->n_pair = 0;
    for (size_t i = 0; i < h->observation->n; i++) {
        const size_t first = m->n_pair;
        double n_path = 0.0;
        for (size_t k = 0; k < h->n_step; k++) {
            for (int q = 0; q < 2; q++) {
                const struct estimate *e = &h->step[k].replica[q][i];
                n_path += (double)e->n_path;
                add_partners(m, first, i, e);
            }
        }
        for (size_t p = first; p < m->n_pair; p++) m->pair[p].correlation /= n_path;
    }
}

status linear_model_pool(struct linear_model *m, const struct linear_history *h, const double *x_ref, struct error *err)
{
    status s = STATUS_OK;
    double *mean = malloc(m->n_row * m->n_param * sizeof *mean);
    struct carried *carried = malloc(h->n_step * sizeof *carried);
    struct pool_weight *weight = malloc(h->n_step * sizeof *weight);
    if (mean == NULL || weight == NULL || carried == NULL) {
        s = error_set(err, STATUS_NO_MEMORY, "cannot average estimates: out of memory");
        goto out;
    }
    memset(m->r[0], 0, 4 * (m->n_row + m->n_row * m->n_param) * sizeof(double)); /* all eight arrays: one block */
    memcpy(m->x_ref, x_ref, m->n_param * sizeof *x_ref);
    mean_derivatives(h, mean);
    m->n_effective = 0.0;
    for (size_t i = 0; i < h->observation->n; i++) pool_configuration(m, h, mean, i, carried, weight);
    for (size_t row = 0; row < m->n_row; row++) set_photograph(m, &h->observation->item[row / 3], row);
    m->n_effective /= (double)h->observation->n;
    pool_pairs(m, h);
    if (m->gain_sd > 0.0) linear_gain_absorb(m, h->observation);
out:
    free(mean);
    free(carried);
    free(weight);
    return s;
}
