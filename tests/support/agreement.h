/* Tests that two Monte-Carlo methods agree: in every pair of results, and in the mean of the relative differences.
 *
 * A pair reveals only a difference of several of its own standard errors. The mean over all pairs reveals a smaller
 * fault that changes all of them alike. All tolerances are AGREEMENT_SE standard errors of the difference. The test
 * states how small a common relative difference it must detect, and fails when its standard errors are too large for
 * that.
 */
#ifndef SELVEDGE_TESTS_AGREEMENT_H
#define SELVEDGE_TESTS_AGREEMENT_H

#include <stdbool.h>

/* About five of 10^4 comparisons fail although the program is correct (two-sided, normal distribution). */
#define AGREEMENT_SE 3.5

struct agreement {
    int n;
    double sum, sum_var; /* of (a - b) / b */
};

/* Prints one pair and its standard errors. Fails the test when the two lie more than AGREEMENT_SE joint standard errors
 * apart. */
void agreement_add(struct agreement *g, double a, double a_se, double b, double b_se);
/* Fails the test when the mean relative difference is not 0 within AGREEMENT_SE of its standard errors, or when its
 * standard error is too large to detect a relative difference of `visible`. */
void agreement_check(const struct agreement *g, double visible);

/* Whether SELVEDGE_TEST_LONG is set: `make test-long` runs tests with many more paths than `make test`. */
bool is_long_variant(void);

#endif
