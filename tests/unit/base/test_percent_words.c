/* Relative errors as words: digits by the standard error, and bounds where noise hides the error. */
#include "base/percent_words.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void test_words(void **state)
{
    (void)state;
    static const struct {
        double share, se;
        const char *words, *in_short;
    } check[] = {
        {0.0471, 0.00098, "4.71 +- 0.10 %", "4.71 %"},
        {0.047123, 0.0005, "4.71 +- 0.05 %", "4.71 %"},
        {0.119, 0.0031, "11.9 +- 0.3 %", "11.9 %"},
        {0.2, 0.099, "20 +- 10 %", "20 %"},
        {1.5, 0.4, "150 +- 40 %", "150 %"},
        {0.0, 0.018, "below 3.6 %", "below 3.6 %"},
        {0.0, 0.0055, "below 1.1 %", "below 1.1 %"}, /* a bound of two digits stays */
        {0.001, 0.005, "below 1.1 %", "below 1.1 %"},
        {0.00101, 0.005, "below 1.2 %", "below 1.2 %"}, /* rounded up */
        {0.0, 0.000995, "below 0.20 %", "below 0.20 %"},
        {0.0, 0.0499, "below 10 %", "below 10 %"},
        {0.1, 0.3, "below 70 %", "below 70 %"},
        {0.0471, NAN, "4.71 %", "4.71 %"},
        {0.0471, 0.0, "4.71 %", "4.71 %"},
        {NAN, 0.1, "-", "-"},
        {INFINITY, NAN, "-", "-"},
    };
    for (size_t i = 0; i < sizeof check / sizeof check[0]; i++) {
        char text[PERCENT_WORDS_BYTES];
        percent_words(check[i].share, check[i].se, text);
        assert_string_equal(text, check[i].words);
        percent_words_short(check[i].share, check[i].se, text);
        assert_string_equal(text, check[i].in_short);
    }
}

/* Over many errors: a bound is never below share + 2 se nor a tenth above it. */
static void test_bounds(void **state)
{
    (void)state;
    for (double se = 1e-5; se < 1.0; se *= 1.07)
        for (double ratio = 0.0; ratio < 2.0; ratio += 0.09) {
            char text[PERCENT_WORDS_BYTES], *end;
            percent_words(ratio * se, se, text);
            assert_int_equal(strncmp(text, "below ", 6), 0);
            const double bound = strtod(text + 6, &end) / 100.0, true_bound = (ratio + 2.0) * se;
            assert_string_equal(end, " %");
            assert_true(bound >= true_bound * (1.0 - 1e-8) && bound <= true_bound * 1.1 + 1e-12);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_words), cmocka_unit_test(test_bounds)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
