/* Names and exposure of the pictures in the results. */
#include "optimizer/report/result/result_json.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void test_picture_names(void **state)
{
    (void)state;
    static const char *const name[] = {"p00.exr", "p00.png", "p.01.exr", "fit-03", "p00"};
    struct observation item[5] = {0};
    struct observation_set o = {.n = 5, .item = item};
    picture_name *picture = NULL;
    for (size_t i = 0; i < 5; i++) snprintf(item[i].name, sizeof item[i].name, "%s", name[i]);
    assert_int_equal(result_picture_names(&o, &picture, NULL), STATUS_OK);
    assert_string_equal(picture[0], "p00");
    assert_string_equal(picture[1], "p00-1");
    assert_string_equal(picture[2], "p.01");
    assert_string_equal(picture[3], "fit-03");
    for (size_t i = 0; i < 5; i++)
        for (size_t j = 0; j < i; j++) assert_string_not_equal(picture[i], picture[j]);
    free(picture);
}

static void test_picture_names_that_are_given_are_unique_too(void **state)
{
    (void)state;
    char longer[JOB_MAX_NAME_BYTES];
    memset(longer, 'y', sizeof longer);
    longer[sizeof longer - 1] = '\0';
    const char *const name[] = {"x-2", "x", "x", "x-6", "x", "x-3", "x", longer, longer};
    enum { COUNT = sizeof name / sizeof name[0] };
    struct observation item[COUNT] = {0};
    struct observation_set o = {.n = COUNT, .item = item};
    picture_name *picture = NULL;
    for (size_t i = 0; i < COUNT; i++) snprintf(item[i].name, sizeof item[i].name, "%s", name[i]);
    assert_int_equal(result_picture_names(&o, &picture, NULL), STATUS_OK);
    assert_string_equal(picture[0], "x-2");
    for (size_t i = 0; i < COUNT; i++)
        for (size_t j = 0; j < i; j++) assert_string_not_equal(picture[i], picture[j]);
    free(picture);
}

static void test_exposure(void **state)
{
    (void)state;
    struct observation item[11] = {0};
    struct observation_set o = {.n = 11, .item = item};
    assert_true(result_png_exposure(&o) == 1.0); /* all rows are black: the exposure stays 1 */
    for (size_t i = 0; i < 11; i++) item[i].mean_rgb[1] = 0.1 * (double)(i + 1);
    item[10].mean_rgb[1] = 50.0; /* one highlight does not darken all pictures */
    assert_true(fabs(result_png_exposure(&o) - 0.8) < 1e-9);
    o.n = 0;
    assert_true(result_png_exposure(&o) == 1.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_picture_names),
                                       cmocka_unit_test(test_picture_names_that_are_given_are_unique_too),
                                       cmocka_unit_test(test_exposure)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
