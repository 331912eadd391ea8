/* textile.v3: the flat section. v and t are even in ph and have the period pi, so they are held over a quarter turn.
 *
 * t (f * t) = 1 - w v is solved at the midpoints of N equal intervals by t <- sqrt(t (1 - w v) / (f * t)), whose
 * error halves at least in every step: with e = ln of the error of t, e <- (e - M e) / 2, and M = t-weighted means has
 * eigenvalues between 0 and 1. The derivative of ln t solves e + M e = d ln (1 - w v) - (df * t) / (f * t), by the
 * same steps. Values between the nodes follow from t = (1 - w v) / (f * t), which needs the nodes only. The midpoint
 * rule is exact to rounding here: the narrowest f has a standard deviation of more than two intervals.
 */
#include "renderer/scattering/models/textile/textile.h"

#include <math.h>
#include <string.h>

enum { N = 48, N_STEP = 48 };

struct section {
    double kappa, norm, at_peak, slope, f, w;
    double t[N], rest[N], kernel[N][N], d_kernel[N][N]; /* kernel: f folded to a quarter turn, times the interval */
    double d[TEXTILE_N_SLOPE][N];                       /* d ln t */
};

static double node_rad(int i) { return (i + 0.5) * M_PI_2 / N; }

static double width_at(double f, double cos_psi) { return sqrt(f * f + (1 - f * f) * cos_psi * cos_psi); }

/* d width / d f. */
static double slope_at(double f, double cos_psi) { return f * (1 - cos_psi * cos_psi) / width_at(f, cos_psi); }

/* One row of the kernel and of its derivative by gamma, for light from psi. */
static void fill_row(const struct section *s, double psi, double *row, double *d_row)
{
    for (int j = 0; j < N; j++) {
        const double apart[4] = {psi - node_rad(j), psi + node_rad(j), psi - node_rad(j) + M_PI,
                                 psi + node_rad(j) + M_PI};
        row[j] = d_row[j] = 0;
        for (int k = 0; k < 4; k++) {
            double far = 1 - cos(apart[k]), value = s->norm * exp(-s->kappa * far) * M_PI_2 / N;
            row[j] += value;
            d_row[j] += value * (s->at_peak - s->slope * far);
        }
    }
}

static double sum_of(const double *row, const double *x)
{
    double sum = 0;
    for (int j = 0; j < N; j++) sum += row[j] * x[j];
    return sum;
}

static void solve(struct section *s)
{
    for (int i = 0; i < N; i++) s->t[i] = sqrt(s->rest[i]);
    for (int n = 0; n < N_STEP; n++) {
        double next[N];
        for (int i = 0; i < N; i++) next[i] = sqrt(s->t[i] * s->rest[i] / sum_of(s->kernel[i], s->t));
        memcpy(s->t, next, sizeof next);
    }
}

/* d ln rest by the three parameters. */
static void rest_slopes(const struct section *s, double cos_psi, double out[TEXTILE_N_SLOPE])
{
    double v = width_at(s->f, cos_psi), rest = 1 - s->w * v;
    out[TEXTILE_BY_GAMMA] = 0;
    out[TEXTILE_BY_W] = -v / rest;
    out[TEXTILE_BY_F] = -s->w * slope_at(s->f, cos_psi) / rest;
}

/* Solves e + M e = source for e. */
static void solve_slope(const struct section *s, const double source[N], double e[N])
{
    memset(e, 0, N * sizeof *e);
    for (int n = 0; n < N_STEP; n++) {
        double te[N], next[N];
        for (int i = 0; i < N; i++) te[i] = s->t[i] * e[i];
        for (int i = 0; i < N; i++)
            next[i] = 0.5 * (e[i] + source[i] - sum_of(s->kernel[i], te) / sum_of(s->kernel[i], s->t));
        memcpy(e, next, sizeof next);
    }
}

static void solve_slopes(struct section *s)
{
    double source[TEXTILE_N_SLOPE][N];
    for (int i = 0; i < N; i++) {
        double by[TEXTILE_N_SLOPE];
        rest_slopes(s, cos(node_rad(i)), by);
        by[TEXTILE_BY_GAMMA] -= sum_of(s->d_kernel[i], s->t) / sum_of(s->kernel[i], s->t);
        for (int k = 0; k < TEXTILE_N_SLOPE; k++) source[k][i] = by[k];
    }
    for (int k = 0; k < TEXTILE_N_SLOPE; k++) solve_slope(s, source[k], s->d[k]);
}

static struct textile_section_entry entry_for(const struct section *s, double cos_psi)
{
    double row[N], d_row[N], by[TEXTILE_N_SLOPE];
    fill_row(s, acos(cos_psi), row, d_row);
    double around = sum_of(row, s->t);
    rest_slopes(s, cos_psi, by);
    by[TEXTILE_BY_GAMMA] -= sum_of(d_row, s->t) / around;
    struct textile_section_entry e = {.t = (float)((1 - s->w * width_at(s->f, cos_psi)) / around)};
    for (int k = 0; k < TEXTILE_N_SLOPE; k++) {
        double td[N];
        for (int j = 0; j < N; j++) td[j] = s->t[j] * s->d[k][j];
        e.d_t[k] = e.t * (float)(by[k] - sum_of(row, td) / around);
    }
    return e;
}

static void fill_mean(struct textile_state *t)
{
    double mean = 0, slope = 0;
    for (int i = 0; i < N; i++) {
        mean += width_at((double)t->f, cos(node_rad(i))) / N;
        slope += slope_at((double)t->f, cos(node_rad(i))) / N;
    }
    t->inv_mean_v = (float)(1 / mean);
    t->d_ln_mean_v = (float)(slope / mean);
}

void textile_section(struct textile_state *t)
{
    const struct von_mises *f = &t->lobes.azimuth;
    struct section s = {.kappa = (double)f->kappa,
                        .norm = (double)f->norm,
                        .at_peak = (double)f->score_at_peak,
                        .slope = (double)f->score_slope,
                        .f = (double)t->f,
                        .w = (double)t->w};
    for (int i = 0; i < N; i++) {
        s.rest[i] = 1 - s.w * width_at(s.f, cos(node_rad(i)));
        fill_row(&s, node_rad(i), s.kernel[i], s.d_kernel[i]);
    }
    solve(&s);
    solve_slopes(&s);
    for (int i = 0; i <= TEXTILE_N_SECTION; i++) t->section[i] = entry_for(&s, (double)i / TEXTILE_N_SECTION);
    fill_mean(t);
}
