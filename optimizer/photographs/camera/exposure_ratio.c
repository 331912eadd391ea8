#include "optimizer/photographs/camera/exposure_ratio.h"

#include "base/small_matrix.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const double prior_sd = 0.05;   /* of ln time: of stated times of shutters */
static const double impossible = 1.25; /* ratio of light to stated times */
static const double warn_from = 0.03;  /* of ln time */

static size_t choose_scale(const struct exposure_set *e, const double *rank, const struct exposure_pair *pair)
{
    size_t best = 0;
    double best_rank = INFINITY;
    bool compared[EXPOSURE_MAX] = {false}, any = false;
    for (size_t i = 0; i + 1 < e->n; i++)
        if (isfinite(pair[i].var)) any = compared[pair[i].shorter] = compared[pair[i].longer] = true;
    for (size_t i = 0; i < e->n; i++) {
        const double own = rank != NULL ? rank[i] : 0.0;
        if (any && !compared[i]) continue;
        if (own > best_rank || (own == best_rank && !(e->t_s[i] > e->t_s[best]))) continue;
        best = i;
        best_rank = own;
    }
    return best;
}

/* Deviations of ln time by the chain of ratios alone, from their median. Returns the largest. */
static double farthest(const struct exposure_set *e, const struct exposure_pair *pair, size_t i_scale, size_t *worst)
{
    double off[EXPOSURE_MAX] = {0}, sorted[EXPOSURE_MAX], largest = 0.0;
    for (size_t i = 0; i + 1 < e->n; i++)
        off[pair[i].longer] = off[pair[i].shorter] - (isfinite(pair[i].var) ? pair[i].value : 0.0);
    for (size_t i = 0; i < e->n; i++) {
        size_t at = i;
        for (; at > 0 && sorted[at - 1] > off[i]; at--) sorted[at] = sorted[at - 1];
        sorted[at] = off[i];
    }
    const double middle = e->n == 2 ? off[i_scale] : sorted[e->n / 2];
    *worst = 0;
    for (size_t i = 0; i < e->n; i++)
        if (fabs(off[i] - middle) > fabs(largest)) {
            largest = off[i] - middle;
            *worst = i;
        }
    return largest;
}

static status check_possible(const struct exposure_set *e, const struct exposure_pair *pair, size_t i_scale,
                             struct error *err)
{
    size_t worst = 0;
    bool sure = false;
    const double off = farthest(e, pair, i_scale, &worst);
    for (size_t i = 0; i + 1 < e->n; i++)
        sure = sure || (isfinite(pair[i].var) && fabs(pair[i].value) > 5.0 * sqrt(pair[i].var));
    if (fabs(off) <= log(impossible) || !sure) return STATUS_OK;
    return error_set(err, STATUS_INVALID,
                     "cannot merge the exposures of '%s': '%s' has %.2g times the light that the others and the "
                     "exposure times predict: check 'exposure_s', and that all show the same view in the same light",
                     e->name[0], e->name[worst], exp(off));
}

/* Most likely ln times, less the stated ones, and their errors. */
static void solve(const struct exposure_set *e, const struct exposure_pair *pair, struct exposure_ratio *r)
{
    double h[EXPOSURE_MAX * EXPOSURE_MAX] = {0}, cov[EXPOSURE_MAX * EXPOSURE_MAX], b[EXPOSURE_MAX] = {0};
    const size_t n = e->n;
    memset(r->log_error, 0, sizeof r->log_error);
    for (size_t i = 0; i < n; i++) h[i * n + i] = i == r->i_scale ? 1e18 : 1.0 / (prior_sd * prior_sd);
    for (size_t i = 0; i + 1 < n; i++) {
        const size_t s = pair[i].shorter, l = pair[i].longer;
        if (!isfinite(pair[i].var)) continue;
        const double w = 1.0 / fmax(pair[i].var, 1e-12);
        h[s * n + s] += w;
        h[l * n + l] += w;
        h[s * n + l] -= w;
        h[l * n + s] -= w;
        b[s] += w * pair[i].value;
        b[l] -= w * pair[i].value;
    }
    for (size_t i = 0; i < n; i++) r->t_s[i] = e->t_s[i];
    if (!small_invert(h, n, cov)) return;
    for (size_t i = 0; i < n; i++) {
        double off = 0.0;
        for (size_t j = 0; j < n; j++) off += cov[i * n + j] * b[j];
        if (i != r->i_scale) r->t_s[i] = e->t_s[i] * exp(off);
    }
    if (!small_factor(cov, n, 0.0)) return;
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k <= i && i != r->i_scale; k++) r->log_error[i][k] = cov[i * n + k];
}

double exposure_ratio_error(const struct exposure_ratio *r, size_t i)
{
    double var = 0.0;
    for (size_t k = 0; k < EXPOSURE_MAX; k++) var += r->log_error[i][k] * r->log_error[i][k];
    return sqrt(var);
}

static void warn(const struct exposure_set *e, const struct exposure_pair *pair, struct exposure_ratio *r)
{
    size_t worst = SIZE_MAX, n = 0;
    for (size_t i = 0; i < e->n; i++) {
        const double off = fabs(log(r->t_s[i] / e->t_s[i]));
        if (off <= fmax(warn_from, 3.0 * exposure_ratio_error(r, i))) continue;
        n++;
        if (worst == SIZE_MAX || off > fabs(log(r->t_s[worst] / e->t_s[worst]))) worst = i;
    }
    if (worst != SIZE_MAX)
        snprintf(r->warning, sizeof r->warning,
                 "exposure '%s' is stated as %.4g s, and by its light against the other exposures it lasted %.4g s "
                 "+- %.1f %%, which is used; '%s' keeps its stated time%s",
                 e->name[worst], e->t_s[worst], r->t_s[worst], 100.0 * exposure_ratio_error(r, worst),
                 e->name[r->i_scale], n > 1 ? "; other exposures are off, too" : "");
    for (size_t i = 0; i + 1 < e->n && r->warning[0] == '\0'; i++)
        if (isfinite(pair[i].var) && pair[i].uneven > warn_from)
            snprintf(r->warning, sizeof r->warning,
                     "the ratio of exposures '%s' and '%s' differs by %.0f %% over the picture: did the camera, the "
                     "cloth or the lamp move between them?",
                     e->name[pair[i].shorter], e->name[pair[i].longer], 100.0 * pair[i].uneven);
}

status exposure_ratio_solve(const struct exposure_set *e, const double *rank, const struct exposure_pair *pair,
                            struct exposure_ratio *r, struct error *err)
{
    memset(r, 0, sizeof *r);
    r->i_scale = choose_scale(e, rank, pair);
    status s = check_possible(e, pair, r->i_scale, err);
    if (s != STATUS_OK) return s;
    solve(e, pair, r);
    warn(e, pair, r);
    return STATUS_OK;
}

status exposure_ratio_fit(const struct exposure_set *e, const double *rank, struct exposure_ratio *r, struct error *err)
{
    struct exposure_pair pair[EXPOSURE_MAX];
    status s = exposure_pairs_compare(e, pair, err);
    return s == STATUS_OK ? exposure_ratio_solve(e, rank, pair, r, err) : s;
}
