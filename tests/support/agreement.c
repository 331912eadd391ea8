#include "tests/support/agreement.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

void agreement_add(struct agreement *g, double a, double a_se, double b, double b_se)
{
    double se = hypot(a_se, b_se), z = (a - b) / se, relative_se = se / b;
    print_message("%.5f and %.5f, joint standard error %.5f (%.2f %%)\n", a, b, se, 100 * relative_se);
    if (!(fabs(z) <= AGREEMENT_SE)) fail_msg("%.1f standard errors apart", z);
    g->n++;
    g->sum += (a - b) / b;
    g->sum_var += relative_se * relative_se;
}

void agreement_check(const struct agreement *g, double visible)
{
    double mean = g->sum / g->n, se = sqrt(g->sum_var) / g->n;
    print_message("mean relative difference %.4f, standard error %.4f\n", mean, se);
    if (!(fabs(mean) <= AGREEMENT_SE * se)) fail_msg("%.1f standard errors from 0", mean / se);
    if (!(AGREEMENT_SE * se <= visible)) fail_msg("the test cannot detect a relative difference of %.4f", visible);
}

bool is_long_variant(void)
{
    const char *text = getenv("SELVEDGE_TEST_LONG");
    return text != NULL && text[0] != '\0';
}
