/* Exif and XMP as hexadecimal digits in text chunks of PNG files. */
#include "optimizer/photographs/reader/png_raw_profile.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

static struct photograph_info read_text(const char *key, const char *text)
{
    struct photograph_info info = {.exposure_s = NAN, .iso = NAN, .aperture = NAN};
    png_raw_profile_read(key, text, strlen(text), &info);
    return info;
}

/* "<exif:FNumber>8</exif:FNumber>" */
#define DIGITS "3c657869663a464e756d6265723e38\n3C2F657869663A464E756D6265723E"

static void test_digits_of_xmp(void **state)
{
    (void)state;
    const double wrapped = read_text("Raw profile type xmp", "\nxmp\n      30\n" DIGITS "\n").aperture;
    assert_true(wrapped == 8.0);
    /* another chunk, digits that break off, and no digits at all */
    assert_true(isnan(read_text("Comment", "\nxmp\n      30\n" DIGITS).aperture));
    assert_true(isnan(read_text("Raw profile type xmp", "\nxmp\n      30\n3c65zz").aperture));
    assert_true(isnan(read_text("Raw profile type exif", "\nexif\n").aperture));
    assert_true(isnan(read_text("Raw profile type APP1", "").aperture));
}

static void test_profiles_of_other_names(void **state)
{
    (void)state;
    const struct photograph_info info = read_text("Raw profile type iptc", "\niptc\n       2\n3838\n");
    const struct file_statement *said = file_ledger_find(&info.ledger, "text profile");
    assert_non_null(said);
    assert_string_equal(said->value, "iptc");
    assert_int_equal(said->use, FILE_STATEMENT_NOT_USED);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_digits_of_xmp),
        cmocka_unit_test(test_profiles_of_other_names),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
