/* Hypothesis tests for Monte-Carlo results. */
#ifndef SELVEDGE_TESTS_STATISTICS_TEST_H
#define SELVEDGE_TESTS_STATISTICS_TEST_H

#include <stddef.h>

/* Returns P(chi^2 with n_degree degrees of freedom >= x). */
double chi_square_tail(double x, double n_degree);
/* Returns the chi-square statistic of counts against expectations and its degrees of freedom. Cells with an
 * expectation below five are pooled. */
double chi_square_statistic(const double *count, const double *expected, size_t n, double *n_degree);

/* Running mean, and variance of the mean. */
struct sample_mean {
    double n, mean, m2;
};
void sample_mean_add(struct sample_mean *s, double x);
double sample_mean_se(const struct sample_mean *s);

#endif
