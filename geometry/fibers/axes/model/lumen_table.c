#include "geometry/fibers/axes/model/lumen_table.h"

#include <math.h>

enum { N_ANGLE = 64, N_STEP = 4 }; /* of the integrals over the angle, and over the radius between two entries */

/* exp(-x) I0(x) and exp(-x) I1(x), by the trapezoidal rule, which converges exponentially for periodic functions. */
static void bessel(double x, double value[2])
{
    value[0] = value[1] = 0.0;
    for (int i = 0; i < N_ANGLE; i++) {
        const double c = cos(M_PI * (i + 0.5) / N_ANGLE), e = exp(x * (c - 1.0)) / N_ANGLE;
        value[0] += e;
        value[1] += c * e;
    }
}

/* exp(-(t^2 + u^2) / 2) I0(t u); *first: the same with I1. */
static double density(double t, double u, double *first)
{
    double value[2];
    bessel(t * u, value);
    const double e = exp(-0.5 * (t - u) * (t - u));
    *first = e * value[1];
    return e * value[0];
}

void lumen_table_init(struct lumen_table *t)
{
    const double step = 1.0 / (LUMEN_PER_UNIT * N_STEP);
    for (int j = 0; j < LUMEN_N_PLACE; j++) {
        const double u = (double)j / LUMEN_PER_UNIT;
        double share = 0.0, first;
        for (int i = 0; i < LUMEN_N_RADIUS; i++) {
            const double r = (double)i / LUMEN_PER_UNIT, zeroth = density(r, u, &first);
            t->entry[i][j] = (struct lumen_image){(float)share, (float)(-r * first), (float)(0.5 * zeroth)};
            for (int k = 0; k < N_STEP; k += 2) { /* Simpson's rule up to the next entry */
                double unused;
                const double a = r + k * step, b = a + step, c = b + step;
                share += step / 3.0 *
                         (a * density(a, u, &unused) + 4.0 * b * density(b, u, &unused) + c * density(c, u, &unused));
            }
        }
    }
}

static float between(float a, float b, float part) { return a + part * (b - a); }

struct lumen_image lumen_table_at(const struct lumen_table *t, float place, float area)
{
    const float last_radius = (float)(LUMEN_N_RADIUS - 1), last_place = (float)(LUMEN_N_PLACE - 1),
                sign = area < 0.0f ? -1.0f : 1.0f;
    float r = sqrtf(fabsf(area)) * LUMEN_PER_UNIT, u = place * LUMEN_PER_UNIT;
    if (r > last_radius) {
        u = fmaxf(0.0f, u - (r - last_radius));
        r = last_radius;
    }
    if (!(u < last_place)) return (struct lumen_image){0.0f, 0.0f, 0.0f};
    const int i = r < last_radius ? (int)r : LUMEN_N_RADIUS - 2, j = (int)u;
    const float x = r - (float)i, y = u - (float)j;
    const struct lumen_image *a = &t->entry[i][j], *b = &t->entry[i + 1][j];
    return (struct lumen_image){
        sign * between(between(a[0].share, a[1].share, y), between(b[0].share, b[1].share, y), x),
        sign * between(between(a[0].by_place, a[1].by_place, y), between(b[0].by_place, b[1].by_place, y), x),
        between(between(a[0].by_area, a[1].by_area, y), between(b[0].by_area, b[1].by_area, y), x)};
}
