#include "optimizer/fit/linear/next_photograph.h"
#include "base/small_matrix.h"
#include "optimizer/fit/objective/objective.h"

#include <math.h>
#include <string.h>

enum { N = FIT_MAX_PARAM };

static const double least_var = 1e-6; /* of a residual: no photograph is more exact than 0.1 % */

struct design {
    size_t n, n_asked;
    size_t index[N]; /* indices of the free unknowns: first n_asked of the model, then nuisance terms */
    double cov[N * N], j[2][3 * N];
    double noise[9]; /* covariance of the residuals by everything but the unknowns */
};

static bool is_nuisance(const struct fit_layout *l, size_t k) { return k == l->i_gain || k == l->i_stray; }

/* Copies the covariance, and narrows the part of undetermined parameters to their range. */
static void take_covariance(struct design *d, const struct next_photograph_fit *f)
{
    const struct fit_layout *l = f->layout;
    double scale[N];
    for (size_t k = 0; k < l->n_unknown; k++)
        if (!l->parameter[k].fixed && !is_nuisance(l, k)) d->index[d->n++] = k;
    d->n_asked = d->n;
    for (size_t k = 0; k < l->n_unknown; k++)
        if (is_nuisance(l, k)) d->index[d->n++] = k;
    for (size_t a = 0; a < d->n; a++) {
        struct coordinate c;
        size_t k = d->index[a];
        double sd = sqrt(f->uncertainty->cov[k * l->n_unknown + k]);
        coordinate_init(&c, &l->info[k], l->parameter[k].lower, l->parameter[k].upper);
        scale[a] = sd > 0.0 ? fmin(1.0, (c.upper - c.lower) / (sqrt(12.0) * sd)) : 0.0;
    }
    for (size_t a = 0; a < d->n; a++)
        for (size_t b = 0; b < d->n; b++)
            d->cov[a * d->n + b] = scale[a] * scale[b] * f->uncertainty->cov[d->index[a] * l->n_unknown + d->index[b]];
    small_clip_eigenvalues(d->cov, d->n, 0.0);
}

/* Fills in the derivatives of the residuals by the fit coordinates, and the covariance of the residuals from
 * everything else. */
static void take_derivatives(struct design *d, const struct next_photograph_fit *f,
                             const struct estimate *const replica[2])
{
    const struct fit_layout *l = f->layout;
    double mean[3], brightness, slope[N];
    for (size_t c = 0; c < 3; c++) mean[c] = 0.5 * (replica[0]->mean[c] + replica[1]->mean[c]);
    brightness = fmax((mean[0] + mean[1] + mean[2]) / 3.0, OBJECTIVE_TAU);
    for (size_t a = 0; a < d->n; a++) {
        struct coordinate k;
        const struct param_info *own = &l->info[d->index[a]];
        coordinate_init(&k, own, own->lower, own->upper);
        slope[a] = coordinate_slope(&k, f->unknown[d->index[a]]) / brightness;
    }
    for (int q = 0; q < 2; q++)
        for (size_t c = 0; c < 3; c++)
            for (size_t a = 0; a < d->n; a++)
                d->j[q][c * d->n + a] = slope[a] * replica[q]->jac[c * l->n_unknown + d->index[a]];
    for (size_t i = 0; i < 9; i++) {
        const size_t c = i / 3, e = i % 3;
        d->noise[i] = f->photograph_gain_sd * f->photograph_gain_sd * mean[c] * mean[e] / (brightness * brightness);
        for (size_t a = 0; a < d->n; a++) {
            const size_t k = d->index[a], ic = c * l->n_unknown + k, ie = e * l->n_unknown + k;
            double vc = 0.5 * (replica[0]->jac_var[ic] + replica[1]->jac_var[ic]),
                   ve = 0.5 * (replica[0]->jac_var[ie] + replica[1]->jac_var[ie]);
            d->noise[i] += d->cov[a * d->n + a] * slope[a] * slope[a] * sqrt(vc * ve);
        }
    }
}

/* Writes J C of each replica to both[q], and the symmetrised J_A C J_B', with eigenvalues clipped to 0 or more, to
 * s[9]. */
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
                sum += 0.5 *
                       (both[0][c * d->n + a] * d->j[1][e * d->n + a] + both[1][c * d->n + a] * d->j[0][e * d->n + a]);
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

/* Covariance of the nuisance terms when the model's parameters are known: a square matrix of n - n_asked rows, 2 at
 * most. */
static void nuisance_given_parameters(const struct design *d, double *given)
{
    double inverse[N * N], asked[N * N];
    size_t n = d->n_asked, m = d->n - n;
    for (size_t a = 0; a < n; a++)
        for (size_t b = 0; b < n; b++) asked[a * n + b] = d->cov[a * d->n + b] * (a == b ? 1.0 + 1e-9 : 1.0);
    bool known = n > 0 && small_invert(asked, n, inverse);
    for (size_t a = 0; a < m; a++)
        for (size_t b = 0; b < m; b++) {
            double sum = d->cov[(n + a) * d->n + n + b];
            for (size_t p = 0; p < n && known; p++)
                for (size_t q = 0; q < n; q++)
                    sum -= d->cov[(n + a) * d->n + p] * inverse[p * n + q] * d->cov[q * d->n + n + b];
            given[a * m + b] = sum;
        }
    small_clip_eigenvalues(given, m, 0.0);
}

/* Covariance of the residuals when the parameters are known: noise + J C J' of the remaining nuisance terms. */
static void residual_given_parameters(const struct design *d, double v[9])
{
    double given[4] = {0};
    size_t n = d->n_asked, m = d->n - n;
    memcpy(v, d->noise, sizeof d->noise);
    if (m == 0) return;
    nuisance_given_parameters(d, given);
    for (size_t i = 0; i < 9; i++) {
        const double *jc[2], *je[2];
        for (int q = 0; q < 2; q++) {
            jc[q] = d->j[q] + (i / 3) * d->n + n;
            je[q] = d->j[q] + (i % 3) * d->n + n;
        }
        for (size_t a = 0; a < m; a++)
            for (size_t b = 0; b < m; b++) v[i] += 0.5 * given[a * m + b] * (jc[0][a] * je[1][b] + jc[1][a] * je[0][b]);
    }
    small_clip_eigenvalues(v, 3, least_var);
}

/* Writes the information of the photograph about unknown d->index[k] to every parameter of the model that follows
 * it. */
static void set_unknown(const struct design *d, size_t k, double decrease, const struct next_photograph_fit *f,
                        struct candidate_score *score)
{
    const struct fit_layout *l = f->layout;
    const struct uncertainty *u = f->uncertainty;
    double before = d->cov[k * d->n + k],
           share = before > 0.0 ? sqrt(fmin(fmax(0.0, 1.0 - decrease / before), 1.0)) : 1.0;
    size_t own = d->index[k];
    struct coordinate c;
    coordinate_init(&c, &l->info[own], l->parameter[own].lower, l->parameter[own].upper);
    bool known = uncertainty_determined(&c, sqrt(before) * share, u->se_param[own] * share);
    for (size_t p = 0; p < l->n_full; p++) {
        if (l->owner[p] != own) continue;
        score->se_after[p] = l->ratio[p] * u->se_param[own] * share;
        score->determines[p] = !u->determined[own] && known;
    }
}

void next_photograph_score(const struct next_photograph_fit *f, const struct estimate *a, const struct estimate *b,
                           struct candidate_score *score)
{
    struct design d = {0};
    struct estimate shown[2];
    const struct estimate *const replica[2] = {&shown[0], &shown[1]};
    const struct uncertainty *u = f->uncertainty;
    const double misfit = f->misfit != NULL ? f->misfit->rest_var : u->misfit_var,
                 smooth = f->misfit != NULL ? f->misfit->smooth_var : 0.0;
    double jc[2][3 * N], s[9], alone[9], inverse[9] = {0},
                                         v = fmax(misfit + u->noise_var + u->photograph_var, least_var);
    memset(score, 0, sizeof *score);
    fit_layout_estimate(f->layout, f->unknown, true, a, &shown[0]);
    fit_layout_estimate(f->layout, f->unknown, true, b, &shown[1]);
    take_covariance(&d, f);
    take_derivatives(&d, f, replica);
    project(&d, jc, s);
    for (size_t i = 0; i < 3; i++) d.noise[i * 4] += v;
    for (size_t i = 0; i < 9; i++) d.noise[i] += smooth;
    for (size_t i = 0; i < 9; i++) s[i] += d.noise[i];
    residual_given_parameters(&d, alone);
    score->misfit_information = 0.5 * log1p(3.0 * smooth / v);
    score->information = fmax(0.5 * (ln_det3(s) - ln_det3(alone)), 0.0) + score->misfit_information;
    (void)small_invert(s, 3, inverse); /* eigenvalues are at least v > 0 */
    for (size_t k = 0; k < d.n_asked; k++) {
        double decrease = 0.0;
        for (size_t i = 0; i < 3; i++)
            for (size_t e = 0; e < 3; e++) decrease += jc[0][i * d.n + k] * inverse[i * 3 + e] * jc[1][e * d.n + k];
        set_unknown(&d, k, decrease, f, score);
    }
}
