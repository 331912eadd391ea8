#include "optimizer/objective/next_photograph.h"
#include "optimizer/objective/objective.h"
#include "optimizer/objective/small_matrix.h"

#include <math.h>
#include <string.h>

enum { N = SCATTERING_MAX_PARAM };

static const double least_var = 1e-6; /* of a residual: nobody photographs better than 0.1 % */

struct design {
    size_t n_param, n;
    size_t index[N]; /* parameters that count: free, leading their ties */
    double cov[N * N], j[2][3 * N];
    double noise[9]; /* covariance of the residuals by the noise of j */
};

/* The covariance of an undetermined parameter can be wider than its range, which is known. */
static void take_covariance(struct design *d, const struct param_info *info, const struct fit_parameter *parameter,
                            const struct uncertainty *u, const size_t *leader)
{
    double scale[N];
    for (size_t p = 0; p < d->n_param; p++)
        if (!parameter[p].fixed && leader[p] == p) d->index[d->n++] = p;
    for (size_t a = 0; a < d->n; a++) {
        struct coordinate k;
        size_t p = d->index[a];
        double sd = sqrt(u->cov[p * d->n_param + p]);
        coordinate_init(&k, &info[p], parameter[p].lower, parameter[p].upper);
        scale[a] = sd > 0.0 ? fmin(1.0, (k.upper - k.lower) / (sqrt(12.0) * sd)) : 0.0;
    }
    for (size_t a = 0; a < d->n; a++)
        for (size_t b = 0; b < d->n; b++) {
            size_t p = d->index[a], q = d->index[b];
            bool apart = a != b && (u->at_bound[p] || u->at_bound[q]);
            d->cov[a * d->n + b] = apart ? 0.0 : scale[a] * scale[b] * u->cov[p * d->n_param + q];
        }
    small_clip_eigenvalues(d->cov, d->n, 0.0);
}

/* Derivatives of the residuals by the fit coordinates of the leaders. */
static void take_derivatives(struct design *d, const struct param_info *info, const double *param, const size_t *leader,
                             const double *ratio, const struct estimate *const replica[2])
{
    double mean = 0.0, slope[N];
    for (int c = 0; c < 3; c++) mean += (replica[0]->mean[c] + replica[1]->mean[c]) / 6.0;
    for (size_t a = 0; a < d->n; a++) {
        struct coordinate k;
        const struct param_info *own = &info[d->index[a]];
        coordinate_init(&k, own, own->lower, own->upper);
        slope[a] = coordinate_slope(&k, param[d->index[a]]) / fmax(mean, OBJECTIVE_TAU);
    }
    for (int q = 0; q < 2; q++)
        for (size_t c = 0; c < 3; c++)
            for (size_t a = 0; a < d->n; a++) {
                double sum = 0.0;
                for (size_t p = 0; p < d->n_param; p++)
                    if (leader[p] == d->index[a]) sum += ratio[p] * replica[q]->jac[c * d->n_param + p];
                d->j[q][c * d->n + a] = sum * slope[a];
            }
    for (size_t a = 0; a < d->n; a++) {
        double sd[3] = {0, 0, 0};
        for (size_t c = 0; c < 3; c++)
            for (size_t p = 0; p < d->n_param; p++)
                if (leader[p] == d->index[a])
                    sd[c] += ratio[p] * slope[a] * sqrt(0.5 * (replica[0]->jac_var[c * d->n_param + p] +
                                                               replica[1]->jac_var[c * d->n_param + p]));
        for (size_t i = 0; i < 9; i++) d->noise[i] += d->cov[a * d->n + a] * sd[i / 3] * sd[i % 3];
    }
}

/* both[q] = J C of each replica; symmetrised J_A C J_B' in s[9], its eigenvalues at least 0. */
static void project(const struct design *d, double both[2][3 * N], double s[9])
{
    for (int q = 0; q < 2; q++)
        for (size_t c = 0; c < 3; c++)
            for (size_t a = 0; a < d->n; a++) {
                double sum = 0.0;
                for (size_t b = 0; b < d->n; b++) sum += d->j[q][c * d->n + b] * d->cov[b * d->n + a];
                both[q][c * d->n + a] = sum;
            }
    for (size_t c = 0; c < 3; c++)
        for (size_t e = 0; e < 3; e++) {
            double sum = 0.0;
            for (size_t a = 0; a < d->n; a++)
                sum += 0.5 * (both[0][c * d->n + a] * d->j[1][e * d->n + a] + both[1][c * d->n + a] * d->j[0][e * d->n + a]);
            s[c * 3 + e] = sum;
        }
    double mirrored[9];
    for (size_t c = 0; c < 3; c++)
        for (size_t e = 0; e < 3; e++) mirrored[c * 3 + e] = 0.5 * (s[c * 3 + e] + s[e * 3 + c]);
    memcpy(s, mirrored, sizeof mirrored);
    small_clip_eigenvalues(s, 3, 0.0);
}

static double ln_det3(const double *a)
{
    double value[3], vector[9], sum = 0.0;
    small_eigen(a, 3, value, vector);
    for (size_t i = 0; i < 3; i++) sum += log(value[i]);
    return sum;
}

void next_photograph_score(const struct param_info *info, const struct fit_parameter *parameter, const double *param,
                           const struct uncertainty *u, const size_t *leader, const double *ratio,
                           const struct estimate *a, const struct estimate *b, struct candidate_score *score)
{
    struct design d = {.n_param = u->n_param};
    const struct estimate *const replica[2] = {a, b};
    double jc[2][3 * N], s[9], inverse[9] = {0}, v = fmax(u->misfit_var + u->noise_var + u->photograph_var, least_var);
    memset(score, 0, sizeof *score);
    take_covariance(&d, info, parameter, u, leader);
    take_derivatives(&d, info, param, leader, ratio, replica);
    project(&d, jc, s);
    for (size_t i = 0; i < 3; i++) d.noise[i * 4] += v;
    for (size_t i = 0; i < 9; i++) s[i] += d.noise[i];
    score->information = 0.5 * (ln_det3(s) - ln_det3(d.noise));
    (void)small_invert(s, 3, inverse); /* eigenvalues are at least v > 0 */
    for (size_t k = 0; k < d.n; k++) {
        double fall = 0.0;
        for (size_t i = 0; i < 3; i++)
            for (size_t e = 0; e < 3; e++) fall += jc[0][i * d.n + k] * inverse[i * 3 + e] * jc[1][e * d.n + k];
        double before = d.cov[k * d.n + k], share = before > 0.0 ? sqrt(fmin(fmax(0.0, 1.0 - fall / before), 1.0)) : 1.0;
        size_t own = d.index[k];
        struct coordinate c;
        coordinate_init(&c, &info[own], parameter[own].lower, parameter[own].upper);
        bool known = uncertainty_determined(&c, sqrt(before) * share, u->se_param[own] * share);
        for (size_t p = 0; p < d.n_param; p++) {
            if (leader[p] != own) continue;
            score->se_after[p] = u->se_param[p] * share;
            score->determines[p] = !u->determined[p] && known;
        }
    }
}
