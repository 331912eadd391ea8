/* Angles in the names of photographs. */
#include "clients/cli/text/name_angles.c" /* NOLINT */

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

static void test_names(void **state)
{
    (void)state;
    struct name_angles a;
    assert_true(name_angles_read("t{light_theta}_p{light_phi}", "T45-p180", &a));
    assert_true(a.given[NAME_LIGHT_THETA] && a.deg[NAME_LIGHT_THETA] == 45.0 && a.deg[NAME_LIGHT_PHI] == 180.0);
    assert_false(a.given[NAME_CAMERA_THETA] || a.given[NAME_ROTATION]);
    assert_true(name_angles_read("*_l{light_theta}_{light_phi}_c{camera_theta}_{camera_phi}*",
                                 "silk 7_l12.5_-90_c0_0_short", &a));
    assert_true(a.deg[NAME_LIGHT_THETA] == 12.5 && a.deg[NAME_LIGHT_PHI] == -90.0 && a.given[NAME_CAMERA_PHI]);
    assert_false(name_angles_read("t{light_theta}_p{light_phi}", "t45_p180_x", &a));
    assert_false(name_angles_read("t{light_theta}_p{light_phi}", "t45_p", &a));
    assert_false(name_angles_read("t{light_theta}", "", &a));
}

static void test_patterns(void **state)
{
    (void)state;
    struct error err;
    assert_int_equal(name_angles_check("v*_{light_theta}_{light_phi}", &err), STATUS_OK);
    assert_int_equal(name_angles_check("t{theta}", &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "'{theta}'"));
    assert_int_equal(name_angles_check("{rotation}_{rotation}", &err), STATUS_INVALID);
    assert_int_equal(name_angles_check("photo", &err), STATUS_INVALID);
}

static void test_usual_patterns(void **state)
{
    (void)state;
    static const char *const one[] = {"t45_p180", "t60_p0"}, *const turned[] = {"lt10_lp0_ct20_cp180_r90"},
                             *const mixed[] = {"t45_p180", "IMG_0042"}, *const four[] = {"30_0_45_180"};
    assert_string_equal(name_angles_guess(one, 2), "t{light_theta}_p{light_phi}");
    assert_non_null(strstr(name_angles_guess(turned, 1), "{rotation}"));
    assert_null(name_angles_guess(mixed, 2));
    assert_null(name_angles_guess(one, 0));
    assert_string_equal(name_angles_guess(four, 1), "{light_theta}_{light_phi}_{camera_theta}_{camera_phi}");
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_names), cmocka_unit_test(test_patterns),
                                       cmocka_unit_test(test_usual_patterns)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
