/* Names of slices: which orders pass, and how each fault of a set is named. */
#include "base/option_id.h"
#include "geometry/volume/format/slice_order.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { MOST = 8 };

static size_t count(const char *const *name)
{
    size_t n = 0;
    while (n < MOST && name[n] != NULL) n++;
    return n;
}

static void sound_sets_pass(void **state)
{
    (void)state;
    static const struct {
        const char *name[MOST];
        unsigned long long step;
    } sound[] = {
        {{"scan.tif"}, 0},
        {{"front.tif", "middle.tif", "back.tif"}, 0},
        {{"s0.tif", "s1.tif", "s2.tif"}, 1},
        {{"s8.tif", "s9.tif", "s10.tif", "s11.tif"}, 1},
        {{"s098.tif", "s099.tif", "s100.TIF"}, 1},
        {{"s11.tif", "s10.tif", "s9.tif"}, 1}, /* from above */
        {{"z0000um.tif", "z0020um.tif", "z0040um.tif"}, 20},
        {{"2024_s1.tif", "2024_s2.tif", "2024_s3.tif"}, 1},
        {{"s1_20240101T120000.tif", "s2_20240101T120007.tif", "s3_20240101T120011.tif"}, 1},
        {{"3.tif", "4.tif"}, 1},
        {{"s20240101120000123456.tif", "s20240101120000123456x.tif"}, 0}, /* no number that counts */
    };
    for (size_t i = 0; i < sizeof sound / sizeof *sound; i++) {
        struct slice_order order;
        struct error err = {0};
        if (slice_order_check(sound[i].name, count(sound[i].name), &order, &err) != STATUS_OK)
            fail_msg("%zu: %s", i, err.text);
        assert_int_equal(order.step, sound[i].step);
    }
}

static void faults_of_sets_are_named(void **state)
{
    (void)state;
    static const struct {
        const char *name[MOST], *says;
    } bad[] = {
        {{"s0.tif", "s1.tif", "s10.tif", "s2.tif"}, "order of their numbers: 's10.tif' comes after 's1.tif'"},
        {{"s0.tif", "s2.tif", "s1.tif"}, "'s2.tif' comes after 's0.tif' and before 's1.tif'"},
        {{"s18.tif", "s19.tif", "s26.tif", "s27.tif"},
         "6 in all are missing: 's20.tif' to 's25.tif' between 's19.tif' and 's26.tif'"},
        {{"s008.tif", "s009.tif", "s011.tif"}, "1 in all are missing: 's010.tif' between 's009.tif' and 's011.tif'"},
        {{"s5.tif", "s3.tif", "s2.tif"}, "'s4.tif'"},
        {{"s0.tif", "s2.tif", "s4.tif", "s8.tif", "s12.tif"}, "2 in all are missing: 's6.tif'"},
        {{"s0.tif", "s1.tif", "s01.tif", "s2.tif"}, "'s1.tif' and 's01.tif' have the same number"},
        {{"s1.tif", "s01.tif"}, "have the same number"},
        {{"s1.tif", "s2.tif", "mask.tif"}, "'mask.tif' does not belong to the slices of 's1.tif'"},
        {{"s1.tif", "s2.tif", "t3.tif"}, "'t3.tif' does not belong"},
        {{"s1.tif", "s2.tiff", "s3.tif"}, "'s2.tiff' does not belong"},
        {{"s.tif", "s1.tif", "s2.tif"}, "'s1.tif' does not belong"},
        {{"z1_c1.tif", "z1_c2.tif", "z2_c1.tif", "z2_c2.tif"}, "count along 2 numbers"},
        {{"part1_1.tif", "part1_2.tif", "part2_1.tif"}, "count along 2 numbers"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct slice_order order;
        struct error err = {0};
        assert_int_equal(slice_order_check(bad[i].name, count(bad[i].name), &order, &err), STATUS_INVALID);
        assert_string_equal(err.field, OPTION_SCAN_FILES);
        if (strstr(err.text, bad[i].says) == NULL) fail_msg("%zu: '%s' does not say '%s'", i, err.text, bad[i].says);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sound_sets_pass),
        cmocka_unit_test(faults_of_sets_are_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
