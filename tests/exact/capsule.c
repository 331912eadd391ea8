#include "tests/exact/capsule.h"

#include <math.h>
#include <string.h>

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

void capsule_finish(struct capsule *c)
{
    for (int k = 0; k < 3; k++) c->axis[k] = c->b[k] - c->a[k];
    c->length = sqrt(dot(c->axis, c->axis));
    c->is_ball = c->length <= fabs(c->radius[0] - c->radius[1]);
    if (c->is_ball) return;
    for (int k = 0; k < 3; k++) c->axis[k] /= c->length;
    c->sine = (c->radius[0] - c->radius[1]) / c->length;
    c->cosine = sqrt(1.0 - c->sine * c->sine);
}

static void join(double t[2], double from, double to)
{
    t[0] = fmin(t[0], from);
    t[1] = fmax(t[1], to);
}

/* The line is taken from its point nearest to the ball, so that distant origins cost no digits. */
static void add_ball(const double centre[3], double radius, const double o[3], const double d[3], double t[2])
{
    double to[3], off2 = 0.0;
    for (int k = 0; k < 3; k++) to[k] = centre[k] - o[k];
    const double nearest = dot(to, d);
    for (int k = 0; k < 3; k++) off2 += (to[k] - nearest * d[k]) * (to[k] - nearest * d[k]);
    const double half2 = radius * radius - off2;
    if (half2 < 0.0) return;
    join(t, nearest - sqrt(half2), nearest + sqrt(half2));
}

/* The solid cone between the circles in which it touches the balls. With y along the axis and rho across it, its inside
 * is cosine rho <= radius[0] - sine y. */
static void add_side(const struct capsule *c, const double o[3], const double d[3], double t[2])
{
    double to[3], m[3];
    for (int k = 0; k < 3; k++) to[k] = 0.5 * (c->a[k] + c->b[k]) - o[k];
    const double start = dot(to, d);
    for (int k = 0; k < 3; k++) m[k] = o[k] + start * d[k] - c->a[k];
    const double y = dot(m, c->axis), dy = dot(d, c->axis), low = c->radius[0] * c->sine,
                 high = c->length + c->radius[1] * c->sine;
    double from = -INFINITY, to_end = INFINITY;
    if (dy != 0.0) {
        from = fmin((low - y) / dy, (high - y) / dy);
        to_end = fmax((low - y) / dy, (high - y) / dy);
    } else if (y < low || y > high)
        return;
    double across[3], d_across[3];
    for (int k = 0; k < 3; k++) {
        across[k] = m[k] - y * c->axis[k];
        d_across[k] = d[k] - dy * c->axis[k];
    }
    const double e = c->radius[0] - c->sine * y, de = -c->sine * dy, cos2 = c->cosine * c->cosine;
    const double qa = cos2 * dot(d_across, d_across) - de * de, qb = cos2 * dot(across, d_across) - e * de,
                 qc = cos2 * dot(across, across) - e * e, root2 = qb * qb - qa * qc;
    if (fabs(qa) < 1e-15) { /* along the surface: inside everywhere or nowhere, up to rounding */
        if (qc > 0.0) return;
    } else if (qa > 0.0) {
        if (root2 < 0.0) return;
        from = fmax(from, (-qb - sqrt(root2)) / qa);
        to_end = fmin(to_end, (-qb + sqrt(root2)) / qa);
    } else if (root2 > 0.0) { /* outside between the roots; one of the two parts lies between the circles */
        const double before = (-qb + sqrt(root2)) / qa, after = (-qb - sqrt(root2)) / qa;
        if (from < before)
            to_end = fmin(to_end, before);
        else
            from = fmax(from, after);
    }
    if (from < to_end) join(t, start + from, start + to_end);
}

bool capsule_interval(const struct capsule *c, const double o[3], const double d[3], double t[2])
{
    t[0] = INFINITY;
    t[1] = -INFINITY;
    add_ball(c->a, c->radius[0], o, d, t);
    add_ball(c->b, c->radius[1], o, d, t);
    if (!c->is_ball) add_side(c, o, d, t);
    return t[0] < t[1];
}

static double from_ball(const double centre[3], double r, const double x[3], double normal[3], double *radius)
{
    for (int k = 0; k < 3; k++) normal[k] = x[k] - centre[k];
    const double away = sqrt(dot(normal, normal));
    for (int k = 0; k < 3; k++) normal[k] /= away;
    *radius = r;
    return away - r;
}

double capsule_distance(const struct capsule *c, const double x[3], double normal[3], double *radius)
{
    if (c->is_ball) {
        const int k = c->radius[0] < c->radius[1];
        return from_ball(k ? c->b : c->a, c->radius[k], x, normal, radius);
    }
    double m[3], across[3];
    for (int k = 0; k < 3; k++) m[k] = x[k] - c->a[k];
    const double y = dot(m, c->axis);
    for (int k = 0; k < 3; k++) across[k] = m[k] - y * c->axis[k];
    const double rho = sqrt(dot(across, across));
    /* along the axis to the ball whose surface lies along the normal */
    const double at = (y - rho * c->sine / c->cosine) / c->length;
    if (at <= 0.0) return from_ball(c->a, c->radius[0], x, normal, radius);
    if (at >= 1.0) return from_ball(c->b, c->radius[1], x, normal, radius);
    for (int k = 0; k < 3; k++) normal[k] = c->cosine * across[k] / rho + c->sine * c->axis[k];
    *radius = c->radius[0] + at * (c->radius[1] - c->radius[0]);
    return c->cosine * rho - (c->radius[0] - c->sine * y);
}
