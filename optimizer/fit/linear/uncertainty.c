#include "optimizer/fit/linear/uncertainty.h"
#include "base/small_matrix.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { N = FIT_MAX_PARAM };
_Static_assert((int)SMALL_MATRIX_MAX >= (int)N, "small_matrix.h takes matrices of all parameters");
/* A positive quantity whose range spans decades counts as determined only if its standard error is below a factor of
 * 2. */
static const double log_determined = 0.69;

/* Least share of the information in J'J that is believed, however large the noise of J is. Near-singular directions
 * would otherwise get errors anywhere between the error by their noise and the whole range, by chance: errors of ten
 * equal fits on analytic cloth differed up to 57-fold, and do so up to 7-fold. */
static const double least_information = 0.25;

/* Share of a photograph's stated variance, without that by the color matrix, that its three channels have in common:
 * exposure, lamp and the patch of cloth are the same for them, noise is not. Sources state no correlation; taken as
 * independent (0), errors of widths, which all channels tell together, would be up to 30 % too small where half of the
 * variance is common. */
static const double photograph_in_common = 0.5;

/* The part of V of one row that is independent of all other rows. The weighted residual of an expected row, whose
 * weight falls with its error, counts as one of a measured row. */
static double own_variance(const struct linear_model *m, size_t row, const double misfit[2])
{
    if (m->expected[row] > 0.0) return misfit[0];
    const double photograph = m->photograph_var[row] - m->color_var[row];
    return (1.0 - photograph_in_common) * photograph + misfit[m->contrast[row] > 0.0] * m->extra[row];
}

static double path_variance(const struct linear_model *m, size_t row) { return linear_model_row_noise(m, row); }

static double common_variance(const struct linear_model *m, size_t row)
{
    return photograph_in_common * (m->photograph_var[row] - m->color_var[row]);
}

typedef double row_variance(const struct linear_model *m, size_t row);

/* The change of J'r of each replica by noise of one standard deviation that is the same in all channels of a
 * configuration. */
struct common_noise {
    double of[2][N];
};

static struct common_noise common_noise(const struct linear_model *m, size_t i, row_variance *variance,
                                        const size_t *index, size_t n)
{
    struct common_noise v = {0};
    for (size_t row = 3 * i; row < 3 * i + 3; row++) {
        double sd = m->weight[row] * sqrt(variance(m, row));
        for (int q = 0; q < 2; q++)
            for (size_t p = 0; p < n; p++) v.of[q][p] += sd * m->j[q][row * m->n_param + index[p]];
    }
    return v;
}

/* Adds the mirrored product of the two replicas' changes by the same noise to b. */
static void add_outer(const struct common_noise *v, size_t n, double *b)
{
    for (size_t p = 0; p < n; p++)
        for (size_t q = 0; q < n; q++) b[p * n + q] += 0.5 * (v->of[0][p] * v->of[1][q] + v->of[1][p] * v->of[0][q]);
}

/* Adds the noise that the three channels of a configuration have in common, because they share their paths and the
 * exposure. */
static void add_common_noise(const struct linear_model *m, size_t i, row_variance *variance, const size_t *index,
                             size_t n, double *b)
{
    const struct common_noise v = common_noise(m, i, variance, index, n);
    add_outer(&v, n, b);
}

/* The part of D, the variance of the gradient, that the noise of the derivative of one row by parameter p makes. */
static double derivative_noise(const struct linear_model *m, size_t row, size_t p)
{
    double u = m->weight[row], va = m->j_var[0][row * m->n_param + p], vb = m->j_var[1][row * m->n_param + p],
           r2 = fmax(0.0, m->r[0][row] * m->r[1][row]) + 4.0 * linear_model_row_noise(m, row);
    return u * u * r2 * 0.25 * (va + vb);
}

/* The covariance of the gradients of two configurations that the noise of their derivatives by parameter p makes. The
 * derivatives correlate like the means. */
static double shared_derivative_noise(const struct linear_model *m, const struct linear_pair *pair, size_t p)
{
    double sum = 0.0;
    for (size_t c = 0; c < 3; c++) {
        const size_t i = 3 * pair->i + c, j = 3 * pair->j + c, at_i = i * m->n_param + p, at_j = j * m->n_param + p;
        double residuals = 0.5 * (m->r[0][i] * m->r[1][j] + m->r[1][i] * m->r[0][j]) +
                           4.0 * pair->correlation * sqrt(linear_model_row_noise(m, i) * linear_model_row_noise(m, j));
        double variance =
            0.25 * sqrt((m->j_var[0][at_i] + m->j_var[1][at_i]) * (m->j_var[0][at_j] + m->j_var[1][at_j]));
        sum += m->weight[i] * m->weight[j] * residuals * pair->correlation * variance;
    }
    return sum;
}

/* Adds the covariance of the noise of tracing between configurations that share their camera paths to b. */
static void add_shared_noise(const struct linear_model *m, const size_t *index, size_t n, double *b)
{
    for (size_t k = 0; k < m->n_pair; k++) {
        const struct common_noise v = common_noise(m, m->pair[k].i, path_variance, index, n),
                                  w = common_noise(m, m->pair[k].j, path_variance, index, n);
        const double half = 0.5 * m->pair[k].correlation;
        for (size_t p = 0; p < n; p++) {
            for (size_t q = 0; q < n; q++)
                b[p * n + q] += half * (v.of[0][p] * w.of[1][q] + v.of[1][p] * w.of[0][q] + w.of[0][p] * v.of[1][q] +
                                        w.of[1][p] * v.of[0][q]);
            b[p * n + p] += 2.0 * shared_derivative_noise(m, &m->pair[k], index[p]);
        }
    }
}

/* Adds the covariance of the gradient by the causes of the color matrix's error, which all rows have in common. */
static void add_color_error(const struct linear_model *m, const size_t *index, size_t n, double *b)
{
    for (size_t cause = 0; cause < LINEAR_COLOR_CAUSES; cause++) {
        struct common_noise v = {0};
        for (size_t row = 0; row < m->n_row; row++) {
            const double error = m->weight[row] * m->color[row * LINEAR_COLOR_CAUSES + cause];
            for (int q = 0; q < 2 && error != 0.0; q++)
                for (size_t p = 0; p < n; p++) v.of[q][p] += error * m->j[q][row * m->n_param + index[p]];
        }
        add_outer(&v, n, b);
    }
}

/* B of the parameters index[0..n-1], and the mean of V without the error of the color matrix. */
static void residual_matrix(const struct linear_model *m, const size_t *index, size_t n, const double misfit[2],
                            double *b, double *mean_variance)
{
    memset(b, 0, n * n * sizeof *b);
    *mean_variance = 0.0;
    for (size_t row = 0; row < m->n_row; row++) {
        const double *ja = m->j[0] + row * m->n_param, *jb = m->j[1] + row * m->n_param;
        double u = m->weight[row], v = own_variance(m, row, misfit);
        *mean_variance += u * (v + common_variance(m, row) + path_variance(m, row)) / (double)m->n_row;
        for (size_t p = 0; p < n; p++) {
            for (size_t q = 0; q < n; q++)
                b[p * n + q] += u * u * v * 0.5 * (ja[index[p]] * jb[index[q]] + jb[index[p]] * ja[index[q]]);
            b[p * n + p] += derivative_noise(m, row, index[p]);
        }
    }
    for (size_t i = 0; i < m->n_row / 3; i++) {
        add_common_noise(m, i, path_variance, index, n, b);
        add_common_noise(m, i, common_variance, index, n, b);
    }
    add_shared_noise(m, index, n, b);
    add_color_error(m, index, n, b);
}

/* J'J of the mean J of both replicas, and the part of it that noise makes by their difference: J_A' J_B symmetrised is
 * mean - noise. */
static void replica_matrices(const struct linear_model *m, const size_t *index, size_t n, const double *scale,
                             double *mean, double *noise)
{
    memset(mean, 0, n * n * sizeof *mean);
    memset(noise, 0, n * n * sizeof *noise);
    for (size_t row = 0; row < m->n_row; row++) {
        const double *a = m->j[0] + row * m->n_param, *b = m->j[1] + row * m->n_param;
        for (size_t p = 0; p < n; p++)
            for (size_t q = 0; q < n; q++) {
                const size_t i = index[p], k = index[q];
                double factor = 0.25 * m->weight[row] * scale[p] * scale[q];
                mean[p * n + q] += factor * (a[i] + b[i]) * (a[k] + b[k]);
                noise[p * n + q] += factor * (a[i] - b[i]) * (a[k] - b[k]);
            }
    }
}

/* out = sum over j of weight_j v_j v_j', v_j being column j of `vector`. */
static void compose(const double *vector, const double *weight, size_t n, double *out)
{
    for (size_t p = 0; p < n; p++)
        for (size_t q = 0; q < n; q++) {
            double sum = 0.0;
            for (size_t j = 0; j < n; j++) sum += weight[j] * vector[p * n + j] * vector[q * n + j];
            out[p * n + q] = sum;
        }
}

/* outer inner outer, symmetric, for symmetric matrices. */
static void enclose(const double *outer, const double *inner, size_t n, double *out)
{
    double half[N * N];
    small_multiply(outer, inner, n, half);
    small_multiply(half, outer, n, out);
    for (size_t p = 0; p < n; p++)
        for (size_t q = 0; q < p; q++) out[p * n + q] = out[q * n + p] = 0.5 * (out[p * n + q] + out[q * n + p]);
}

/* H + L for the range as the only prior, in units of `scale`: of the mean of both replicas, less the noise that their
 * difference shows, but not less than least_information of it. */
static void information(const struct linear_model *m, const size_t *index, size_t n, const double *scale, double s2,
                        double *h)
{
    double mean[N * N], noise[N * N], value[N], vector[N * N], root[N * N], inverse_root[N * N], weight[N];
    replica_matrices(m, index, n, scale, mean, noise);
    for (size_t p = 0; p < n; p++) mean[p * n + p] += s2;
    small_eigen(mean, n, value, vector);
    for (size_t j = 0; j < n; j++) weight[j] = sqrt(fmax(value[j], s2));
    compose(vector, weight, n, root);
    for (size_t j = 0; j < n; j++) weight[j] = 1.0 / weight[j];
    compose(vector, weight, n, inverse_root);
    enclose(inverse_root, noise, n, mean);
    small_eigen(mean, n, value, vector);
    for (size_t j = 0; j < n; j++) weight[j] = fmax(1.0 - value[j], least_information);
    compose(vector, weight, n, noise);
    enclose(root, noise, n, h);
}

/* Standard deviation of a uniform distribution over the allowed range. */
static double range_sd(const struct coordinate *k) { return (k->upper - k->lower) / sqrt(12.0); }

/* Precision of the model's own prior of parameter p, in units of the range's. */
static double prior_precision(const struct linear_model *m, const struct coordinate *k, size_t p)
{
    return m->prior != NULL ? m->prior[p].precision * range_sd(k) * range_sd(k) : 0.0;
}

/* Covariance of the parameters index[0..n-1] with all others fixed. */
static void covariance(const struct linear_model *m, const struct coordinate *k, const size_t *index, size_t n,
                       const double misfit[2], double *cov)
{
    double h[N * N], b[N * N], inverse[N * N], half[N * N], s2, scale[N];
    residual_matrix(m, index, n, misfit, b, &s2);
    s2 = fmax(s2, 1e-12);
    for (size_t p = 0; p < n; p++) scale[p] = range_sd(&k[index[p]]);
    information(m, index, n, scale, s2, h);
    for (size_t p = 0; p < n; p++)
        for (size_t q = 0; q < n; q++) b[p * n + q] *= scale[p] * scale[q];
    small_clip_eigenvalues(b, n, 0.0);
    for (size_t p = 0; p < n; p++) {
        double precision = prior_precision(m, &k[index[p]], index[p]);
        h[p * n + p] += s2 * precision;
        b[p * n + p] += s2 * s2 * (1.0 + precision);
    }
    if (!small_invert(h, n,
                      inverse)) { /* cannot happen, since all eigenvalues are above 0; the prior alone would remain */
        memset(inverse, 0, n * n * sizeof *inverse);
        for (size_t p = 0; p < n; p++) inverse[p * n + p] = 1.0 / s2;
    }
    small_multiply(inverse, b, n, half);
    small_multiply(half, inverse, n, cov);
    for (size_t p = 0; p < n; p++)
        for (size_t q = 0; q < n; q++) cov[p * n + q] *= scale[p] * scale[q];
}

/* H of the parameters index[0..n-1], and the part of B that the noise of tracing makes. */
static void tracing_matrices(const struct linear_model *m, const size_t *index, size_t n, double *h, double *b)
{
    memset(h, 0, n * n * sizeof *h);
    memset(b, 0, n * n * sizeof *b);
    for (size_t row = 0; row < m->n_row; row++) {
        const double *ja = m->j[0] + row * m->n_param, *jb = m->j[1] + row * m->n_param;
        double u = m->weight[row];
        for (size_t p = 0; p < n; p++) {
            for (size_t q = 0; q < n; q++)
                h[p * n + q] += 0.5 * u * (ja[index[p]] * jb[index[q]] + jb[index[p]] * ja[index[q]]);
            b[p * n + p] += derivative_noise(m, row, index[p]);
        }
    }
    for (size_t i = 0; i < m->n_row / 3; i++) add_common_noise(m, i, path_variance, index, n, b);
    add_shared_noise(m, index, n, b);
}

double uncertainty_noise_decrease(const struct linear_model *m, const struct coordinate *k, const bool *fixed)
{
    double h[N * N], b[N * N], inverse[N * N], sum = 0.0;
    size_t index[N] = {0}, n = 0;
    for (size_t p = 0; p < m->n_param; p++)
        if (!fixed[p]) index[n++] = p;
    tracing_matrices(m, index, n, h, b);
    for (size_t p = 0; p < n; p++)
        for (size_t q = 0; q < n; q++) {
            double scale = range_sd(&k[index[p]]) * range_sd(&k[index[q]]);
            h[p * n + q] *= scale;
            b[p * n + q] *= scale;
        }
    small_clip_eigenvalues(h, n, 0.0);
    for (size_t p = 0; p < n; p++)
        h[p * n + p] += fmax(m->row_var, 1e-12) * (1.0 + prior_precision(m, &k[index[p]], index[p]));
    if (!small_invert(h, n, inverse)) return INFINITY;
    for (size_t p = 0; p < n; p++)
        for (size_t q = 0; q < n; q++) sum += inverse[p * n + q] * b[q * n + p];
    return fmax(0.0, sum);
}

static void scatter(const double *cov, const size_t *index, size_t n, size_t n_param, double *full)
{
    for (size_t p = 0; p < n; p++)
        for (size_t q = 0; q < n; q++) full[index[p] * n_param + index[q]] = cov[p * n + q];
}

/* Near the low end of a logarithmic range every error is small beside the range, so the coordinate is tested too. */
bool uncertainty_determined(const struct coordinate *k, double sd, double se_param)
{
    bool in_proportion = k->kind != PARAM_LOG || sd < log_determined;
    return in_proportion && sd < 0.5 * (k->upper - k->lower) / sqrt(12.0) &&
           se_param < 0.5 * (k->param_upper - k->param_lower) / sqrt(12.0);
}

/* Mean variances of residuals of means, for extra weight 1, over the rows of a weight above 0. */
static void mean_variances(const struct linear_model *m, struct uncertainty *u)
{
    double n = 0.0;
    for (size_t row = 0; row < m->n_row; row++) {
        if (!(m->extra[row] > 0.0) || m->contrast[row] > 0.0 || m->expected[row] > 0.0) continue;
        u->noise_var += linear_model_row_noise(m, row) / m->extra[row];
        u->photograph_var += m->photograph_var[row] / m->extra[row];
        n += 1.0;
    }
    u->noise_var /= fmax(n, 1.0);
    u->photograph_var /= fmax(n, 1.0);
}

/* Whether x is within a thousandth of the range from a bound; ranges over decades are measured in the logarithm. */
static bool at_bound(const struct coordinate *k, double x)
{
    if (k->kind == PARAM_LOG) {
        double margin = 1e-3 * (k->upper - k->lower);
        return x <= k->lower + margin || x >= k->upper - margin;
    }
    double value = coordinate_to_param(k, x), margin = 1e-3 * (k->param_upper - k->param_lower);
    return value <= k->param_lower + margin || value >= k->param_upper - margin;
}

void uncertainty_compute(const struct linear_model *m, const struct coordinate *k, const bool *fixed,
                         struct uncertainty *u)
{
    size_t n = m->n_param, moving[N], n_moving = 0, n_inner = 0;
    double cov[N * N], misfit[2];
    memset(u, 0, sizeof *u);
    u->n_param = n;
    for (size_t p = 0; p < n; p++) {
        u->at_bound[p] = !fixed[p] && at_bound(&k[p], m->x_ref[p]);
        if (!fixed[p]) moving[n_moving++] = p;
        n_inner += !fixed[p] && !u->at_bound[p];
    }
    linear_model_misfits(m, n_inner, misfit);
    u->misfit_var = misfit[0];
    mean_variances(m, u);
    if (n_moving > 0) {
        covariance(m, k, moving, n_moving, misfit, cov);
        scatter(cov, moving, n_moving, n, u->cov);
    }
    for (size_t p = 0; p < n; p++) {
        double uniform = (k[p].param_upper - k[p].param_lower) / sqrt(12.0);
        double slope = coordinate_slope(&k[p], coordinate_to_param(&k[p], m->x_ref[p]));
        double most = m->prior != NULL && m->prior[p].precision > 0.0 ? slope / sqrt(m->prior[p].precision) : uniform;
        u->se_param[p] = fixed[p] ? 0.0 : fmin(slope * sqrt(u->cov[p * n + p]), fmin(uniform, most));
        u->determined[p] = fixed[p] || uncertainty_determined(&k[p], sqrt(u->cov[p * n + p]), u->se_param[p]);
        u->correlation[p * n + p] = 1.0;
    }
    for (size_t a = 0; a < n_moving; a++) {
        for (size_t c = 0; c < a; c++) {
            size_t p = moving[a], q = moving[c];
            double r = u->cov[p * n + q] / sqrt(u->cov[p * n + p] * u->cov[q * n + q]);
            u->correlation[p * n + q] = u->correlation[q * n + p] = fmin(fmax(r, -1.0), 1.0);
        }
    }
}
