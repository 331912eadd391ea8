/* Statements of XMP packets, without a file around them. */
#include "optimizer/photographs/reader/xmp.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

/* A time of zero, as some programs write for "not known", is no statement. */
static void test_xmp_of_zero(void **state)
{
    (void)state;
    static const char packet[] = "<exif:ExposureTime>0/1</exif:ExposureTime><exif:FNumber>8</exif:FNumber>";
    struct photograph_info info = {.exposure_s = NAN, .iso = NAN, .aperture = NAN};
    xmp_read(packet, sizeof packet - 1, &info);
    assert_true(isnan(info.exposure_s) && isnan(info.iso) && info.aperture == 8.0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_xmp_of_zero)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
