/* Two Monte-Carlo methods that must agree: pair by pair, and in the mean of their relative differences.
 *
 * One pair sees only a difference of several of its own standard errors. A fault that changes all pairs alike shows
 * earlier in their mean. All tolerances are AGREEMENT_SE standard errors of the difference; the
 * test states how small a common relative difference it has to see, and fails when its standard errors are too large for
 * that.
 */
#ifndef SELVEDGE_TESTS_AGREEMENT_H
#define SELVEDGE_TESTS_AGREEMENT_H

#include <stdbool.h>

/* Of 10^4 runs of a correct program some five fail (two-sided, normal). */
#define AGREEMENT_SE 3.5

struct agreement {
    int n;
    double sum, sum_var; /* of (a - b) / b */
};

/* Prints one pair and its standard errors; fails the test when they lie more than AGREEMENT_SE joint standard errors apart. */
void agreement_add(struct agreement *g, double a, double a_se, double b, double b_se);
/* Fails the test when the mean relative difference is not 0 within AGREEMENT_SE of its standard errors, or when those
 * errors would hide a relative difference of `visible`. */
void agreement_check(const struct agreement *g, double visible);

/* Whether SELVEDGE_TEST_LONG is set: `make test-long` runs tests with many more paths than `make test`. */
bool is_long_variant(void);

#endif
