/* Names with numbers have the order of the numbers. */
#include "base/natural_order.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void numbers_are_compared_as_numbers(void **state)
{
    (void)state;
    static const char *const sorted[] = {"",
                                         "a",
                                         "a1b2",
                                         "a1b10",
                                         "a2",
                                         "a10",
                                         "a010c",
                                         "b",
                                         "s1.tif",
                                         "s2.tif",
                                         "s10.tif",
                                         "s0100.tif",
                                         "s9999999999999999999998",
                                         "s9999999999999999999999"};
    const size_t n = sizeof sorted / sizeof *sorted;
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < n; k++) {
            const int order = natural_compare(sorted[i], sorted[k]);
            assert_int_equal((order > 0) - (order < 0), (i > k) - (i < k));
        }
    /* equal numbers: the order of the bytes, so that no two names are equal */
    assert_true(natural_compare("a02", "a2") < 0 && natural_compare("a2", "a02") > 0);
}

static void names_are_sorted(void **state)
{
    (void)state;
    const char *name[] = {"s10", "s9", "s1", "s11", "s0"};
    static const char *const want[] = {"s0", "s1", "s9", "s10", "s11"};
    qsort(name, 5, sizeof *name, natural_compare_names);
    for (size_t i = 0; i < 5; i++) assert_string_equal(name[i], want[i]);
}

static void the_order_is_shown(void **state)
{
    (void)state;
    static const char *const name[] = {"s0.tif", "s1.tif", "s2.tif", "a very long name of a sample and number 017.tif"};
    static const char *const want[] = {"1 file: s0.tif", "2 files: s0.tif, s1.tif",
                                       "3 files: s0.tif, s1.tif ... s2.tif",
                                       "4 files: s0.tif, s1.tif ... a very ...d number 017.tif"};
    for (size_t n = 1; n <= 4; n++) {
        char text[120];
        natural_order_text(name, n, text, sizeof text);
        assert_string_equal(text, want[n - 1]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(numbers_are_compared_as_numbers),
        cmocka_unit_test(names_are_sorted),
        cmocka_unit_test(the_order_is_shown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
