#include "optimizer/fit/objective/noisy_minimum.h"
#include "base/small_matrix.h"

#include <math.h>
#include <string.h>

enum { N_COEFFICIENT = 5, N_GRID = 256, N_NEWTON = 20 };
/* Least number of points for a polynomial of so many coefficients: 6 for a cubic, 8 for a quartic. */
static const size_t n_for[N_COEFFICIENT + 1] = {0, 0, 0, 0, 6, 8};

/* Points to the sides are placed where the function rises by this many standard errors of a point. That rise is well
 * measurable; farther out the function departs from the polynomial. */
static const double side_rise = 4.0;
/* Allowed deviation of a point from the polynomial, as a share of its rise over the lowest point. */
static const double bend = 0.2;

static size_t lowest(const struct noisy_minimum *m)
{
    size_t best = 0;
    for (size_t i = 1; i < m->n_point; i++)
        if (m->point[i].f < m->point[best].f) best = i;
    return best;
}

/* f = sum of x[k] t^k, t = u - u0. */
struct polynomial {
    size_t n; /* coefficients */
    double u0, x[N_COEFFICIENT], cov[N_COEFFICIENT * N_COEFFICIENT];
};

static void powers(double t, size_t n, double row[N_COEFFICIENT])
{
    row[0] = 1.0;
    for (size_t k = 1; k < n; k++) row[k] = row[k - 1] * t;
}

static double weight(const struct noisy_minimum *m, size_t i)
{
    double off = bend * (m->point[i].f - m->point[lowest(m)].f);
    return 1.0 / (m->point[i].se * m->point[i].se + off * off);
}

static double chi2_per_freedom(const struct noisy_minimum *m, const struct polynomial *p)
{
    double chi2 = 0.0, row[N_COEFFICIENT];
    if (m->n_point <= p->n) return 1.0;
    for (size_t i = 0; i < m->n_point; i++) {
        double r = m->point[i].f;
        powers(m->point[i].u - p->u0, p->n, row);
        for (size_t k = 0; k < p->n; k++) r -= p->x[k] * row[k];
        chi2 += weight(m, i) * r * r;
    }
    return chi2 / (double)(m->n_point - p->n);
}

/* Weighted least squares; false when the points do not determine n coefficients. */
static bool fit_polynomial(const struct noisy_minimum *m, size_t n, struct polynomial *p)
{
    double normal[N_COEFFICIENT * N_COEFFICIENT] = {0}, right[N_COEFFICIENT] = {0}, row[N_COEFFICIENT];
    *p = (struct polynomial){.n = n, .u0 = m->point[lowest(m)].u};
    for (size_t i = 0; i < m->n_point; i++) {
        double w = weight(m, i);
        powers(m->point[i].u - p->u0, n, row);
        for (size_t a = 0; a < n; a++) {
            right[a] += w * row[a] * m->point[i].f;
            for (size_t b = 0; b < n; b++) normal[n * a + b] += w * row[a] * row[b];
        }
    }
    if (!small_invert(normal, n, p->cov)) return false;
    for (size_t a = 0; a < n; a++)
        for (size_t b = 0; b < n; b++) p->x[a] += p->cov[n * a + b] * right[b];
    double inflate = fmax(1.0, chi2_per_freedom(m, p));
    for (size_t k = 0; k < n * n; k++) p->cov[k] *= inflate;
    return isfinite(p->x[0] + p->x[1] + p->x[n - 1]);
}

static double variance_of(const struct polynomial *p, const double row[N_COEFFICIENT])
{
    double sum = 0.0;
    for (size_t a = 0; a < p->n; a++)
        for (size_t b = 0; b < p->n; b++) sum += row[a] * p->cov[p->n * a + b] * row[b];
    return fmax(sum, 0.0);
}

/* Derivative k of the polynomial as a row of factors of its coefficients, at t. */
static void derivative_row(size_t n, int k, double t, double row[N_COEFFICIENT])
{
    for (size_t a = 0; a < n; a++) {
        double factor = 1.0;
        for (int j = 0; j < k; j++) factor *= (double)a - j;
        row[a] = factor != 0.0 ? factor * pow(t, (double)a - k) : 0.0;
    }
}

static double derivative(const struct polynomial *p, int k, double t)
{
    double row[N_COEFFICIENT], sum = 0.0;
    derivative_row(p->n, k, t, row);
    for (size_t a = 0; a < p->n; a++) sum += row[a] * p->x[a];
    return sum;
}

/* The minimum inside the bounds that is nearest to the lowest point; false when there is none. */
static bool find_vertex(const struct polynomial *p, const struct noisy_minimum_option *o, double *t)
{
    double step = (o->upper - o->lower) / N_GRID, nearest = INFINITY;
    for (int i = 0; i < N_GRID; i++) {
        double left = o->lower - p->u0 + i * step, middle = left + 0.5 * step;
        if (derivative(p, 1, left) > 0.0 || derivative(p, 1, left + step) < 0.0 || fabs(middle) >= nearest) continue;
        nearest = fabs(middle);
        *t = middle;
    }
    for (int i = 0; i < N_NEWTON && isfinite(nearest); i++) {
        double bent = derivative(p, 2, *t);
        if (!(bent > 0.0)) return false;
        *t -= fmin(fmax(derivative(p, 1, *t) / bent, -step), step);
    }
    return isfinite(nearest) && p->u0 + *t > o->lower && p->u0 + *t < o->upper;
}

/* Sets the vertex and its error by the delta method. Returns false when there is none. */
static bool set_vertex(struct noisy_minimum *m, const struct noisy_minimum_option *o, const struct polynomial *p)
{
    double t = 0.0, slope[N_COEFFICIENT], bent[N_COEFFICIENT];
    if (!find_vertex(p, o, &t)) return false;
    derivative_row(p->n, 1, t, slope);
    derivative_row(p->n, 2, t, bent);
    m->curvature = derivative(p, 2, t);
    m->curvature_se = sqrt(variance_of(p, bent));
    m->u = p->u0 + t;
    m->u_se = sqrt(variance_of(p, slope)) / m->curvature;
    m->f = derivative(p, 0, t);
    m->at_bound = false;
    return m->curvature > 0.0;
}

/* For a function without measurable curvature: the minimum is the bound towards which the function falls, if its
 * slope is beyond doubt. */
static void set_slope(struct noisy_minimum *m, const struct noisy_minimum_option *o)
{
    struct polynomial p;
    m->u = m->point[lowest(m)].u;
    m->f = m->point[lowest(m)].f;
    m->u_se = INFINITY;
    m->curvature = m->curvature_se = 0.0;
    m->at_bound = false;
    if (!fit_polynomial(m, 2, &p) || fabs(p.x[1]) < 2.0 * sqrt(p.cov[3])) return;
    m->u = p.x[1] > 0.0 ? o->lower : o->upper;
    m->at_bound = true;
}

/* Finds the minimum from all points by the polynomial of the highest degree whose curvature is beyond doubt. Returns
 * false when there is none. */
static bool locate(struct noisy_minimum *m, const struct noisy_minimum_option *o)
{
    struct polynomial p;
    for (size_t n = N_COEFFICIENT; n >= 3; n--)
        if (m->n_point >= n_for[n] && fit_polynomial(m, n, &p) && set_vertex(m, o, &p) &&
            (n == 3 || m->curvature > 2.0 * m->curvature_se))
            return true;
    set_slope(m, o);
    return false;
}

/* Returns the point half way between the lowest point and its farther neighbour. */
static double bisect(const struct noisy_minimum *m)
{
    double u = m->point[lowest(m)].u, left = -INFINITY, right = INFINITY;
    for (size_t i = 0; i < m->n_point; i++) {
        double x = m->point[i].u;
        if (x < u) left = fmax(left, x);
        if (x > u) right = fmin(right, x);
    }
    if (!isfinite(left)) return 0.5 * (u + right);
    if (!isfinite(right)) return 0.5 * (u + left);
    return u - left > right - u ? 0.5 * (left + u) : 0.5 * (right + u);
}

/* Returns the next place to evaluate: the vertex, then its two sides in turn. */
static double next_place(const struct noisy_minimum *m, const struct noisy_minimum_option *o, size_t turn)
{
    double range = o->upper - o->lower, se = m->point[lowest(m)].se;
    double side = sqrt(2.0 * side_rise * se / m->curvature);
    side = fmin(fmax(side, 0.02 * range), 0.35 * range);
    double u = turn % 3 == 0 ? m->u : m->u + (turn % 3 == 1 ? side : -side);
    if (u < o->lower || u > o->upper) u = 2.0 * m->u - u; /* then take the other side */
    u = fmin(fmax(u, o->lower), o->upper);
    for (size_t i = 0; i < m->n_point; i++) /* avoid a place that has been evaluated already */
        if (fabs(m->point[i].u - u) < 1e-3 * range) u += (u + 0.01 * range <= o->upper ? 0.01 : -0.01) * range;
    return fmin(fmax(u, o->lower), o->upper);
}

static status add_point(struct noisy_minimum *m, double u,
                        status (*evaluate)(void *context, double u, double *f, double *se, struct error *err),
                        void *context, struct error *err)
{
    struct noisy_point *p = &m->point[m->n_point];
    p->u = u;
    status s = evaluate(context, u, &p->f, &p->se, err);
    if (s != STATUS_OK) return s;
    if (!isfinite(p->f) || !(p->se > 0.0))
        return error_set(err, STATUS_NUMERIC, "cannot look for a minimum: the value at %g is %g +- %g", u, p->f, p->se);
    m->n_point++;
    return STATUS_OK;
}

status noisy_minimum_search(const struct noisy_minimum_option *o,
                            status (*evaluate)(void *context, double u, double *f, double *se, struct error *err),
                            void *context, struct noisy_minimum *m, struct error *err)
{
    memset(m, 0, sizeof *m);
    if (!(o->lower < o->upper) || o->n_first < 4 || o->n_most < o->n_first || o->n_most > NOISY_MAX_POINT)
        return error_set(err, STATUS_INVALID, "cannot look for a minimum between %g and %g with %zu to %zu points",
                         o->lower, o->upper, o->n_first, o->n_most);
    bool found = false;
    for (size_t i = 0; i < o->n_most; i++) {
        double u = o->lower + (o->upper - o->lower) * (double)i / (double)(o->n_first - 1);
        if (i >= o->n_first) u = found ? next_place(m, o, i - o->n_first) : bisect(m);
        status s = add_point(m, u, evaluate, context, err);
        if (s != STATUS_OK) return s;
        if (i + 1 < o->n_first) continue;
        found = locate(m, o);
        if (found && !m->at_bound && i + 1 >= o->n_first + 3 && m->u_se < o->tolerance) break;
    }
    m->determined = found && !m->at_bound && m->curvature > 2.0 * m->curvature_se &&
                    m->u_se < 0.5 * (o->upper - o->lower) / sqrt(12.0);
    return STATUS_OK;
}
