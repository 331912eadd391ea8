#include "renderer/glint/triangle_gaussian.h"

#include <math.h>

/* The exponent is -(m[0] x^2 / 2 + m[1] x y + m[2] y^2 / 2 + g[0] x + g[1] y + c) <= 0 on the triangle x, y >= 0,
 * x + y <= 1, whose coordinates are shares of the legs. */
struct quadratic {
    double m[3], g[2], c;
};

static void quadratic_init(const struct glint_triangle *t, const struct triangle_query *q, struct quadratic *e)
{
    const double *p = q->inverse, *l = t->leg, per_r = 1 / q->variance_r;
    const double d[2] = {t->corner[0] - q->center[0], t->corner[1] - q->center[1]};
    const double pd[2] = {p[0] * d[0] + p[1] * d[1], p[1] * d[0] + p[2] * d[1]};
    e->m[0] = p[0] * l[0] * l[0];
    e->m[1] = p[1] * l[0] * l[1];
    e->m[2] = p[2] * l[1] * l[1];
    e->g[0] = pd[0] * l[0];
    e->g[1] = pd[1] * l[1];
    e->c = (d[0] * pd[0] + d[1] * pd[1]) / 2;
    for (int k = 0; k < 2; k++) {
        const double n = t->normal[0][k] - q->half[k], a = t->normal[1][k] - t->normal[0][k],
                     b = t->normal[2][k] - t->normal[0][k];
        e->m[0] += a * a * per_r;
        e->m[1] += a * b * per_r;
        e->m[2] += b * b * per_r;
        e->g[0] += a * n * per_r;
        e->g[1] += b * n * per_r;
        e->c += n * n * per_r / 2;
    }
}

/* Integral over y in 0..1 - x. */
static double inner(const struct quadratic *e, double x)
{
    const double b = e->m[1] * x + e->g[1], rest = e->m[0] * x * x / 2 + e->g[0] * x + e->c, scale = sqrt(e->m[2] / 2);
    if (scale < 1e-5) return (1 - x) * exp(-rest - b * (1 - x) / 2);
    const double peak = -b / e->m[2];
    const double share = erf((1 - x - peak) * scale) - erf(-peak * scale);
    return share == 0 ? 0 : exp(fmin(b * b / (2 * e->m[2]) - rest, 0)) * share * sqrt(M_PI) / (2 * scale);
}

double triangle_gaussian(const struct glint_triangle *t, const struct triangle_query *q)
{
    static const double node[4] = {0.0694318442029737, 0.3300094782075719, 0.6699905217924281, 0.9305681557970263};
    static const double weight[4] = {0.1739274225687269, 0.3260725774312731, 0.3260725774312731, 0.1739274225687269};
    struct quadratic e;
    quadratic_init(t, q, &e);
    if (e.m[0] > e.m[2]) {
        const double m = e.m[0], g = e.g[0];
        e.m[0] = e.m[2];
        e.m[2] = m;
        e.g[0] = e.g[1];
        e.g[1] = g;
    }
    /* the outer integrand is a Gaussian of the precision a times a difference of two steps */
    const double lean = e.m[1] / e.m[2], a = fmax(e.m[0] - lean * e.m[1], 1e-12), root = sqrt(e.m[2]);
    const double middle = (lean * e.g[1] - e.g[0]) / a, sigma = 1 / sqrt(a);
    const double first = fmax(0, middle - 6 * sigma), last = fmin(1, middle + 6 * sigma);
    if (!(last > first)) return 0;
    const double finest = fmin(sigma, fmin(1 / (root * fabs(lean) + 1e-9), 1 / (root * fabs(lean - 1) + 1e-9)));
    const double n = fmin(ceil((last - first) / (1.5 * finest)), 64), width = (last - first) / n;
    double sum = 0;
    for (double k = 0; k < n; k++)
        for (int i = 0; i < 4; i++) sum += weight[i] * inner(&e, first + (k + node[i]) * width);
    return sum * width * fabs(t->leg[0] * t->leg[1]);
}
