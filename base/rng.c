#include "base/rng.h"

#include <math.h>

void rng_normal_pair(struct rng *r, double out[2])
{
    double u = 1.0 - rng_double(r); /* in (0, 1], so that the logarithm is finite */
    double radius = sqrt(-2.0 * log(u));
    double angle = 2.0 * M_PI * rng_double(r);
    out[0] = radius * cos(angle);
    out[1] = radius * sin(angle);
}

static uint64_t poisson_inversion(struct rng *r, double mean)
{
    double p = exp(-mean), cumulative = p, u = rng_double(r);
    uint64_t k = 0;
    while (u > cumulative && k < 1000) {
        k++;
        p *= mean / (double)k;
        cumulative += p;
    }
    return k;
}

/* Hoermann 1993, "The transformed rejection method for generating Poisson random variables", PTRS. */
static uint64_t poisson_ptrs(struct rng *r, double mean)
{
    const double log_mean = log(mean);
    const double b = 0.931 + 2.53 * sqrt(mean);
    const double a = -0.059 + 0.02483 * b;
    const double inv_alpha = 1.1239 + 1.1328 / (b - 3.4);
    const double v_r = 0.9277 - 3.6224 / (b - 2.0);
    int sign; /* lgamma_r, because lgamma writes the sign to a variable that all threads share */
    for (;;) {
        double u = rng_double(r) - 0.5;
        double v = 1.0 - rng_double(r);
        double us = 0.5 - fabs(u);
        double k = floor((2.0 * a / us + b) * u + mean + 0.43);
        if (us >= 0.07 && v <= v_r) return (uint64_t)k;
        if (k < 0.0 || (us < 0.013 && v > us)) continue;
        if (log(v) + log(inv_alpha) - log(a / (us * us) + b) <= -mean + k * log_mean - lgamma_r(k + 1.0, &sign))
            return (uint64_t)k;
    }
}

uint64_t rng_poisson(struct rng *r, double mean)
{
    if (!(mean > 0.0)) return 0;
    return mean < 30.0 ? poisson_inversion(r, mean) : poisson_ptrs(r, mean);
}
