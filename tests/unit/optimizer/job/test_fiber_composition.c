/* What a cloth is made of, as its label says it. */
#include "optimizer/job/document/fiber_composition.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void labels(void **state)
{
    (void)state;
    struct fiber_composition c;
    assert_int_equal(fiber_composition_read("60 % cotton, 40 % recycled polyester", &c, NULL), STATUS_OK);
    assert_int_equal(c.n_part, 2);
    assert_string_equal(c.part[0].name, "cotton");
    assert_string_equal(c.part[1].name, "recycled polyester");
    assert_true(fabs(c.part[0].share - 0.6) < 1e-12);
    assert_int_equal(fiber_composition_read(" 33.3% Wool;33.3% Silk;33.3%Linen ", &c, NULL), STATUS_OK);
    assert_true(c.n_part == 3 && fabs(c.part[2].share - 1.0 / 3.0) < 1e-12);
    assert_string_equal(c.part[2].name, "Linen");
    assert_int_equal(fiber_composition_read("", &c, NULL), STATUS_OK);
    assert_int_equal(c.n_part, 0);
}

static void faults(void **state)
{
    (void)state;
    static const char *const bad[][2] = {{"cotton", "'cotton' is not a percentage"},
                                         {"100 cotton", "'100 cotton'"},
                                         {"60 % cotton", "sum to 60 %"},
                                         {"60 % cotton, 50 % wool", "sum to 110 %"},
                                         {"60 % cotton, 40 %", "'40 %'"},
                                         {"-5 % cotton, 105 % wool", "'-5 % cotton'"},
                                         {"nan % cotton", "'nan % cotton'"}};
    struct fiber_composition c;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct error err = {0};
        assert_int_equal(fiber_composition_read(bad[i][0], &c, &err), STATUS_INVALID);
        if (strstr(err.text, bad[i][1]) == NULL) fail_msg("%s: %s", bad[i][0], err.text);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(labels), cmocka_unit_test(faults)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
