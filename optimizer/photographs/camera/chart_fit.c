#include "optimizer/photographs/camera/chart_fit.h"

#include "base/small_matrix.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

enum { N = 9 + CHART_FALL_TERMS, LEAST_PATCHES = 8, ROUNDS = 4 };
static const double prior_sd[CHART_FALL_TERMS] = {0.15, 0.15, 0.06, 0.06, 0.06};
static const double floor_share = 0.05; /* of white, added to a patch's radiance for its weight */
static const double least_sd = 1e-5;    /* relative, of residuals */

/* State of a fit: normal equations in the scaled unknowns (matrix times `unit`, fall). */
struct equations {
    const struct chart_patches *p;
    size_t left_out; /* patch that does not count; SIZE_MAX: none */
    double unit;     /* largest measured value */
    double x[N], inverse[N * N];
    double misfit[9]; /* covariance of relative residuals beyond noise */
    double total;     /* mean variance of relative residuals */
};

static void fall_terms(const double at[2], const double scale_at[2], double term[CHART_FALL_TERMS])
{
    const double *s = scale_at;
    const double own[] = {at[0], at[1], at[0] * at[0], at[0] * at[1], at[1] * at[1]},
                 there[] = {s[0], s[1], s[0] * s[0], s[0] * s[1], s[1] * s[1]};
    for (size_t j = 0; j < CHART_FALL_TERMS; j++) term[j] = own[j] - there[j];
}

/* Radiance of a patch that its errors are relative to. */
static double level(const struct chart_patches *p, size_t i)
{
    const double *r = p->wanted[i];
    return (r[0] + r[1] + r[2]) / 3.0 + floor_share * p->white;
}

/* The row of patch i and channel c: row' x = wanted. */
static void row_of(const struct equations *e, size_t i, size_t c, double row[N])
{
    double term[CHART_FALL_TERMS];
    memset(row, 0, N * sizeof *row);
    fall_terms(e->p->place[i], e->p->scale_at, term);
    for (size_t k = 0; k < 3; k++) row[3 * c + k] = e->p->measured[i][k] / e->unit;
    for (size_t j = 0; j < CHART_FALL_TERMS; j++) row[9 + j] = -e->p->wanted[i][c] * term[j];
}

/* Solves for x with the prior's weight by the variance of the residuals so far. */
static bool solve(struct equations *e)
{
    double h[N * N] = {0}, b[N] = {0};
    for (size_t i = 0; i < e->p->n; i++) {
        const double w = i == e->left_out ? 0.0 : 1.0 / (level(e->p, i) * level(e->p, i));
        for (size_t c = 0; c < 3 && w > 0.0; c++) {
            double row[N];
            row_of(e, i, c, row);
            for (size_t j = 0; j < N; j++) {
                b[j] += w * row[j] * e->p->wanted[i][c];
                for (size_t k = 0; k < N; k++) h[j * N + k] += w * row[j] * row[k];
            }
        }
    }
    double factor[N * N];
    memcpy(factor, h, sizeof factor);
    for (size_t j = 0; j < CHART_FALL_TERMS; j++) h[(9 + j) * (N + 1)] += e->total / (prior_sd[j] * prior_sd[j]);
    for (size_t c = 0; c < 3; c++) { /* colors that determine no matrix, whatever the fall is */
        double block[9];
        for (size_t j = 0; j < 9; j++) block[j] = factor[(3 * c + j / 3) * N + 3 * c + j % 3];
        if (!small_factor(block, 3, 1e-7 * (block[0] + block[4] + block[8]))) return false;
    }
    if (!small_invert(h, N, e->inverse)) return false;
    for (size_t j = 0; j < N; j++) {
        e->x[j] = 0.0;
        for (size_t k = 0; k < N; k++) e->x[j] += e->inverse[j * N + k] * b[k];
    }
    return true;
}

/* Covariance of the radiances of patch i by the noise of its mean. */
static void noise_of(const struct equations *e, size_t i, double cov[9])
{
    for (size_t a = 0; a < 9; a++) {
        cov[a] = 0.0;
        for (size_t k = 0; k < 3; k++)
            cov[a] += e->x[3 * (a / 3) + k] * e->x[3 * (a % 3) + k] * e->p->var[i][k] / (e->unit * e->unit);
    }
}

/* Residuals of patch i over its level, and the patch's leverage, the share of its own values in their fit. */
static double relative_residuals(const struct equations *e, size_t i, double r[3])
{
    const double over = 1.0 / level(e->p, i);
    double leverage = 0.0;
    for (size_t c = 0; c < 3; c++) {
        double row[N];
        row_of(e, i, c, row);
        r[c] = -e->p->wanted[i][c];
        for (size_t j = 0; j < N; j++) {
            r[c] += row[j] * e->x[j];
            for (size_t k = 0; k < N; k++) leverage += row[j] * e->inverse[j * N + k] * row[k] * over * over / 3.0;
        }
        r[c] *= over;
    }
    return fmin(leverage, 0.9);
}

/* Covariance of the relative residuals as if each patch were left out of the fit (MacKinnon and White 1985, HC3), and
 * its part beyond noise. */
static void judge_residuals(struct equations *e)
{
    double square[9] = {0}, noise[9] = {0}, n = 0.0;
    for (size_t i = 0; i < e->p->n; i++) {
        double r[3], own[9];
        if (i == e->left_out) continue;
        const double over = 1.0 / level(e->p, i), left = 1.0 - relative_residuals(e, i, r);
        noise_of(e, i, own);
        for (size_t a = 0; a < 9; a++) {
            square[a] += r[a / 3] * r[a % 3] / (left * left);
            noise[a] += own[a] * over * over / left;
        }
        n += 1.0;
    }
    for (size_t a = 0; a < 9; a++) e->misfit[a] = (square[a] - noise[a]) / n;
    e->total = fmax((square[0] + square[4] + square[8]) / 3.0 / n, least_sd * least_sd);
    small_clip_eigenvalues(e->misfit, 3, 0.0);
}

static bool fit_equations(struct equations *e)
{
    size_t n = e->p->n - (e->left_out < e->p->n);
    if (n < LEAST_PATCHES) return false;
    e->unit = 0.0;
    for (size_t i = 0; i < 3 * e->p->n; i++) e->unit = fmax(e->unit, e->p->measured[i / 3][i % 3]);
    if (!(e->unit > 0.0)) return false;
    e->total = 1e-4;
    for (size_t round = 0; round < ROUNDS; round++) {
        if (!solve(e)) return false;
        judge_residuals(e);
    }
    return true;
}

/* Sets the covariance of the unscaled matrix. */
static void covariance(const struct equations *e, double cov[81])
{
    double b[N * N] = {0}, half[N * N], all[N * N];
    for (size_t i = 0; i < e->p->n; i++) {
        const double l = level(e->p, i), w = 1.0 / (l * l);
        double v[9], row[3][N];
        if (i == e->left_out) continue;
        double r[3];
        const double left = 1.0 - relative_residuals(e, i, r);
        noise_of(e, i, v);
        for (size_t a = 0; a < 9; a++)
            v[a] = 0.5 * (v[a] + (e->misfit[a] + r[a / 3] * r[a % 3] / (left * left)) * l * l);
        for (size_t c = 0; c < 3; c++) row_of(e, i, c, row[c]);
        for (size_t a = 0; a < 9; a++)
            for (size_t j = 0; j < N; j++)
                for (size_t k = 0; k < N; k++) b[j * N + k] += w * w * v[a] * row[a / 3][j] * row[a % 3][k];
    }
    for (size_t j = 0; j < CHART_FALL_TERMS; j++)
        b[(9 + j) * (N + 1)] += e->total * e->total / (prior_sd[j] * prior_sd[j]);
    small_multiply(e->inverse, b, N, half);
    small_multiply(half, e->inverse, N, all);
    for (size_t j = 0; j < 9; j++)
        for (size_t k = 0; k < 9; k++) cov[9 * j + k] = 0.5 * (all[j * N + k] + all[k * N + j]) / (e->unit * e->unit);
}

static void keep(const struct equations *e, struct chart_fit *fit)
{
    for (size_t j = 0; j < 9; j++) fit->matrix[j] = e->x[j] / e->unit;
    memcpy(fit->fall, e->x + 9, sizeof fit->fall);
    memcpy(fit->scale_at, e->p->scale_at, sizeof fit->scale_at);
}

status chart_fit_patches(const struct chart_patches *p, struct chart_fit *fit, struct error *err)
{
    struct equations e = {.p = p, .left_out = SIZE_MAX};
    if (!fit_equations(&e))
        return error_set(err, STATUS_NUMERIC,
                         "cannot fit a color matrix: the patches have too few different colors to determine it");
    keep(&e, fit);
    covariance(&e, fit->cov);
    return STATUS_OK;
}

double chart_fit_light(const struct chart_fit *fit, const double place[2])
{
    double term[CHART_FALL_TERMS], light = 1.0;
    fall_terms(place, fit->scale_at, term);
    for (size_t j = 0; j < CHART_FALL_TERMS; j++) light += fit->fall[j] * term[j];
    return light;
}

double chart_fit_factor(const struct chart_patches *p, const struct chart_fit *fit)
{
    double over = 0.0, under = 0.0;
    for (size_t i = 0; i < p->n; i++) {
        const double light = chart_fit_light(fit, p->place[i]), w = 1.0 / (level(p, i) * level(p, i));
        for (size_t c = 0; c < 3; c++) {
            over += w * light * p->wanted[i][c] * p->measured[i][c];
            under += w * p->measured[i][c] * p->measured[i][c];
        }
    }
    return over / under;
}

bool chart_fit_left_out(const struct chart_patches *p, size_t i, double rgb[3])
{
    struct equations e = {.p = p, .left_out = i};
    struct chart_fit fit;
    if (!fit_equations(&e)) return false;
    keep(&e, &fit);
    const double light = chart_fit_light(&fit, p->place[i]);
    for (size_t c = 0; c < 3; c++) {
        rgb[c] = 0.0;
        for (size_t k = 0; k < 3; k++) rgb[c] += fit.matrix[3 * c + k] * p->measured[i][k] / light;
    }
    return light > 0.0;
}

void color_matrix_error(const double cov[81], const double in[3], double error[3][COLOR_MATRIX_CAUSES])
{
    double value[9], vector[81];
    small_eigen(cov, 9, value, vector);
    for (size_t c = 0; c < 3; c++)
        for (size_t e = 0; e < 9; e++) {
            error[c][e] = 0.0;
            for (size_t k = 0; k < 3; k++) error[c][e] += vector[9 * (3 * c + k) + e] * in[k];
            error[c][e] *= sqrt(fmax(value[e], 0.0));
        }
}
