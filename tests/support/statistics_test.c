#include "tests/support/statistics_test.h"

#include <math.h>

/* Returns the regularised upper incomplete gamma function: by its series below a + 1, by a continued fraction above
 * (Numerical Recipes 6.2). */
static double gamma_q(double a, double x)
{
    if (x <= 0) return 1;
    double front = exp(-x + a * log(x) - lgamma(a));
    if (x < a + 1) {
        double term = 1 / a, sum = term;
        for (double n = a + 1; term > sum * 1e-15; n++) sum += term *= x / n;
        return 1 - front * sum;
    }
    double b = x + 1 - a, c = 1e300, d = 1 / b, h = d;
    for (int i = 1; i < 10000; i++) {
        double an = -i * (i - a);
        b += 2;
        d = 1 / (an * d + b);
        c = b + an / c;
        h *= d * c;
        if (fabs(d * c - 1) < 1e-14) break;
    }
    return front * h;
}

double chi_square_tail(double x, double n_degree) { return gamma_q(0.5 * n_degree, 0.5 * x); }

double chi_square_statistic(const double *count, const double *expected, size_t n, double *n_degree)
{
    double sum = 0, pooled_count = 0, pooled_expected = 0, cells = 0;
    for (size_t i = 0; i < n; i++) {
        if (expected[i] < 5) {
            pooled_count += count[i];
            pooled_expected += expected[i];
            continue;
        }
        double d = count[i] - expected[i];
        sum += d * d / expected[i];
        cells++;
    }
    if (pooled_expected > 5) {
        double d = pooled_count - pooled_expected;
        sum += d * d / pooled_expected;
        cells++;
    }
    *n_degree = cells - 1;
    return sum;
}

void sample_mean_add(struct sample_mean *s, double x)
{
    double d = x - s->mean;
    s->n++;
    s->mean += d / s->n;
    s->m2 += d * (x - s->mean);
}

double sample_mean_se(const struct sample_mean *s) { return sqrt(s->m2 / (s->n * (s->n - 1))); }
