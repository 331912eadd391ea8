/* The formats of scans by the endings of file names. */
#include "base/catalogue/volume_format.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

static void test_endings(void **state)
{
    (void)state;
    assert_true(volume_format_of("scan.tif")->may_be_slices);
    assert_true(volume_format_of("SCAN.TIFF") == volume_format_of("scan.tif"));
    assert_false(volume_format_of("scan.vol")->may_be_slices);
    assert_null(volume_format_of("scan"));
    assert_null(volume_format_of("tif"));
    assert_null(volume_format_of("scan.vol.gz"));
}

static void test_headers(void **state)
{
    (void)state;
    const struct volume_format *meta = volume_format_of("scan.MHD"), *nrrd = volume_format_of("scan.nhdr");
    assert_true(volume_format_is_header(meta, "scan.MHD"));
    assert_false(volume_format_is_header(meta, "scan.mha"));
    assert_int_equal(meta->separator, '=');
    assert_true(volume_format_is_header(nrrd, "scan.nhdr"));
    assert_false(volume_format_is_header(nrrd, "scan.nrrd"));
    assert_false(volume_format_is_header(volume_format_of("a.tif"), "a.tif"));
    const struct volume_format *nifti = volume_format_of("scan.hdr");
    assert_true(volume_format_is_header(nifti, "scan.hdr") && nifti == volume_format_of("scan.img"));
    assert_false(volume_format_is_header(nifti, "scan.nii.gz"));
    assert_string_equal(nifti->data_ending, ".img");
}

/* Every ending that a user may give stands in the list of the help, but for TIFF, which stands there by name. */
static void test_list(void **state)
{
    (void)state;
    static const char *const shown[] = {"TIFF", ".mhd", ".mha",    ".nrrd", ".nhdr", ".vol",
                                        ".npy", ".nii", ".nii.gz", ".hdr",  ".h5",   ".hdf5"};
    for (size_t i = 0; i < sizeof shown / sizeof shown[0]; i++) assert_non_null(strstr(volume_format_list, shown[i]));
    assert_int_equal(volume_format_list[0], 'T');
}

int main(void)
{
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_endings),
        cmocka_unit_test(test_headers),
        cmocka_unit_test(test_list),
    };
    return cmocka_run_group_tests(test, NULL, NULL);
}
