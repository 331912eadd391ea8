#include "tests/bench/pictures/field_comparison.h"

#include <math.h>

#define SETTLED_SHARE 0.125

/* Variance of the mean. */
static double variance(const struct field_sum *s, int c)
{
    return fmax(0.0, s->x2[c] - s->x[c] * s->x[c] / s->n) / (s->n * (s->n - 1.0));
}

static double brightness(const struct field_sum *first, const struct field_sum *second)
{
    double sum = 0.0;
    for (int c = 0; c < 3; c++) sum += first->x[c] / first->n + second->x[c] / second->n;
    return sum;
}

static void add(struct field_comparison *r, const struct field_sum *first, const struct field_sum *second)
{
    double of_field = 0.0;
    for (int c = 0; c < 3; c++, r->n += 1.0) {
        double mean = first->x[c] / first->n, d = second->x[c] / second->n - mean;
        const double noise2[2] = {variance(first, c), variance(second, c)};
        r->mean += mean;
        r->difference += d;
        r->error2 += d * d;
        for (int i = 0; i < 2; i++) r->noise2[i] += noise2[i];
        of_field += d * d - noise2[0] - noise2[1];
    }
    r->square2 += of_field * of_field;
}

struct field_comparison field_comparison_of(const struct field_sum *first, const struct field_sum *second,
                                            size_t n_field)
{
    struct field_comparison r = {0};
    double all = 0.0;
    for (size_t i = 0; i < n_field; i++) all += brightness(first + i, second + i) / (double)n_field;
    for (size_t i = 0; i < n_field; i++)
        if (brightness(first + i, second + i) > FIELD_LIT * all) add(&r, first + i, second + i);
    return r;
}

double field_comparison_square(const struct field_comparison *r)
{
    return (r->error2 - r->noise2[0] - r->noise2[1]) * r->n / (r->mean * r->mean);
}

double field_comparison_square_se(const struct field_comparison *r)
{
    double sum = r->error2 - r->noise2[0] - r->noise2[1], n_field = r->n / 3.0;
    return sqrt(fmax(0.0, r->square2 - sum * sum / n_field) * n_field / (n_field - 1.0)) * r->n / (r->mean * r->mean);
}

double field_comparison_noise(const struct field_comparison *r, size_t i_picture)
{
    return sqrt(r->noise2[i_picture] * r->n) / r->mean;
}

struct field_speedup field_speedup_of(double at_equal_noise, double square, double square_se, double error)
{
    const double goal2 = error * error, seen = fmax(0.0, square);
    if (square - 2.0 * square_se > goal2) return (struct field_speedup){FIELD_SPEEDUP_ABOVE, 0.0, 0.0};
    if (!(seen + 2.0 * square_se < goal2)) return (struct field_speedup){FIELD_SPEEDUP_NOT_RESOLVED, 0.0, 0.0};
    return (struct field_speedup){FIELD_SPEEDUP_SHOWN, at_equal_noise * (1.0 - seen / goal2),
                                  at_equal_noise * (1.0 - (seen + 2.0 * square_se) / goal2)};
}

bool field_speedup_is_settled(double square, double square_se, double error)
{
    const struct field_speedup s = field_speedup_of(1.0, square, square_se, error);
    return s.verdict == FIELD_SPEEDUP_ABOVE ||
           (s.verdict == FIELD_SPEEDUP_SHOWN && square_se < SETTLED_SHARE * error * error);
}
