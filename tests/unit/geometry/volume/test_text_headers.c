/* Fields of the text headers of NRRD and MetaImage one by one: every name of a type and a unit, and what is refused. */
#include "base/option_id.h"
#include "geometry/volume/format/volume_source.h"
#include "tests/support/scan/scan_expectation.h"
#include "tests/support/scratch_folder.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const size_t n[3] = {2, 1, 2};
static const double unknown[3] = {0, 0, 0};

/* Writes header and data, and opens the file. */
static const char *write_file(void **state, const char *name, const char *header, const void *data, size_t n_data)
{
    static uint8_t file[100000];
    const char *path = scratch_path(state, name);
    scratch_write(path, file, scan_join_header(file, header, data, n_data));
    return path;
}

static void refuse(void **state, const char *name, const char *header, status code, const char *part)
{
    uint8_t data[64];
    memset(data, 'x', sizeof data);
    scan_expect_refused(write_file(state, name, header, data, 16), NULL, code, OPTION_SCAN_FILES, part);
}

struct named_type {
    const char *name;
    uint8_t data[32];
    size_t n_data;
    float value[4];
};
#define BYTES {0, 1, 128, 255}, 4
#define SHORTS {1, 0, 0, 1, 255, 255, 0, 128}, 8
#define WORDS {1, 0, 0, 0, 0, 0, 1, 0, 255, 255, 255, 255, 0, 0, 0, 128}, 16
#define UNSIGNED_8                                                                                                     \
    {                                                                                                                  \
        0, 1, 128, 255                                                                                                 \
    }
#define SIGNED_8                                                                                                       \
    {                                                                                                                  \
        0, 1, -128, -1                                                                                                 \
    }
#define UNSIGNED_16                                                                                                    \
    {                                                                                                                  \
        1, 256, 65535, 32768                                                                                           \
    }
#define SIGNED_16                                                                                                      \
    {                                                                                                                  \
        1, 256, -1, -32768                                                                                             \
    }
#define UNSIGNED_32                                                                                                    \
    {                                                                                                                  \
        1, 65536, 4294967295.0f, 2147483648.0f                                                                         \
    }
#define SIGNED_32                                                                                                      \
    {                                                                                                                  \
        1, 65536, -1, -2147483648.0f                                                                                   \
    }
#define DOUBLES                                                                                                        \
    {0, 0, 0, 0, 0, 0, 0xf0, 0x3f, 0, 0, 0, 0, 0, 0, 0xe0, 0xbf, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0x40}, 32

static const struct named_type nrrd_type[] = {
    {"uchar", BYTES, UNSIGNED_8},
    {"unsigned char", BYTES, UNSIGNED_8},
    {"uint8", BYTES, UNSIGNED_8},
    {"uint8_t", BYTES, UNSIGNED_8},
    {"signed char", BYTES, SIGNED_8},
    {"int8", BYTES, SIGNED_8},
    {"int8_t", BYTES, SIGNED_8},
    {"ushort", SHORTS, UNSIGNED_16},
    {"unsigned short", SHORTS, UNSIGNED_16},
    {"uint16", SHORTS, UNSIGNED_16},
    {"short", SHORTS, SIGNED_16},
    {"SHORT INT", SHORTS, SIGNED_16},
    {"int16_t", SHORTS, SIGNED_16},
    {"uint", WORDS, UNSIGNED_32},
    {"unsigned int", WORDS, UNSIGNED_32},
    {"uint32", WORDS, UNSIGNED_32},
    {"int", WORDS, SIGNED_32},
    {"int32", WORDS, SIGNED_32},
    {"signed int", WORDS, SIGNED_32},
    {"double", DOUBLES, {1, -0.5f, 0, 2}},
};
static const struct named_type meta_type[] = {
    {"MET_UCHAR", BYTES, UNSIGNED_8},          {"MET_CHAR", BYTES, SIGNED_8},    {"MET_USHORT", SHORTS, UNSIGNED_16},
    {"MET_SHORT", SHORTS, SIGNED_16},          {"MET_UINT", WORDS, UNSIGNED_32}, {"MET_INT", WORDS, SIGNED_32},
    {"MET_DOUBLE", DOUBLES, {1, -0.5f, 0, 2}},
};

static void test_types(void **state)
{
    char header[400];
    for (size_t i = 0; i < sizeof nrrd_type / sizeof *nrrd_type; i++) {
        snprintf(header, sizeof header,
                 "NRRD0004\ntype: %s\ndimension: 3\nsizes: 2 1 2\nendian: little\nencoding: raw\n\n",
                 nrrd_type[i].name);
        const char *path = write_file(state, "t.nrrd", header, nrrd_type[i].data, nrrd_type[i].n_data);
        scan_expect_values(&path, 1, NULL, n, unknown, nrrd_type[i].value);
    }
    for (size_t i = 0; i < sizeof meta_type / sizeof *meta_type; i++) {
        snprintf(header, sizeof header, "NDims = 3\nDimSize = 2 1 2\nElementType = %s\nElementDataFile = LOCAL\n",
                 meta_type[i].name);
        const char *path = write_file(state, "t.mha", header, meta_type[i].data, meta_type[i].n_data);
        scan_expect_values(&path, 1, NULL, n, unknown, meta_type[i].value);
    }
}

static void test_units(void **state)
{
    static const struct {
        const char *name;
        double in_mm;
    } nrrd[] = {{"mm", 1},
                {"millimeter", 1},
                {"millimeters", 1},
                {"um", 1e-3},
                {"\xc2\xb5m", 1e-3},
                {"\xce\xbcm", 1e-3},
                {"micron", 1e-3},
                {"Microns", 1e-3},
                {"micrometer", 1e-3},
                {"micrometers", 1e-3},
                {"nm", 1e-6},
                {"cm", 10},
                {"m", 1000},
                {"", 1}},
      meta[] = {{"?", 1}, {"um", 1e-3}, {"mm", 1}, {"CM", 10}};
    static const uint8_t data[4] = {0, 1, 128, 255};
    static const float want[4] = UNSIGNED_8;
    char header[400];
    for (size_t i = 0; i < sizeof nrrd / sizeof *nrrd; i++) {
        const double s = 0.004 / nrrd[i].in_mm, mm[3] = {0.004, 0.008, 0.012};
        snprintf(header, sizeof header,
                 "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 1 2\nencoding: raw\nspacings: %.9g %.9g -%.9g\nspace "
                 "units: \"%s\" \"%s\" \"%s\"\n\n",
                 s, 2 * s, 3 * s, nrrd[i].name, nrrd[i].name, nrrd[i].name);
        const char *path = write_file(state, "u.nrrd", header, data, 4);
        scan_expect_values(&path, 1, NULL, n, mm, want);
    }
    for (size_t i = 0; i < sizeof meta / sizeof *meta; i++) {
        const double s = 0.004 / meta[i].in_mm, mm[3] = {0.004, 0.008, 0.012};
        snprintf(header, sizeof header,
                 "NDims = 3\nDimSize = 2 1 2\nDistanceUnits = %s\nElementSpacing = %.9g %.9g %.9g\nElementSize = 9 9 "
                 "9\nElementType = MET_UCHAR\nElementDataFile = Local\n",
                 meta[i].name, s, 2 * s, 3 * s);
        const char *path = write_file(state, "u.mha", header, data, 4);
        scan_expect_values(&path, 1, NULL, n, mm, want);
    }
    const char *size = "NDims = 3\nDimSize = 2 1 2\nElementSize = 0.001 0.002 0.003\nElementType = "
                       "MET_UCHAR\nElementDataFile = LOCAL\n";
    const char *path = write_file(state, "s.mha", size, data, 4);
    scan_expect_values(&path, 1, NULL, n, (const double[3]){0.001, 0.002, 0.003}, want);
}

#define NRRD "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 1 2\nencoding: raw\n"
#define META "NDims = 3\nDimSize = 2 1 2\nElementType = MET_UCHAR\n"

static void test_refused_nrrd(void **state)
{
    static const struct {
        const char *header, *part;
        status code;
    } check[] = {
        {NRRD "data file: LIST\n", "data in a list of files is not supported", STATUS_UNSUPPORTED},
        {NRRD "data file: slice%03d.raw 1 3 1\n", "data in a list of files is not supported", STATUS_UNSUPPORTED},
        {NRRD "data file:\n", "the data file must be beside the header", STATUS_FORMAT},
        {NRRD "data file: a/b.raw\n", "the data file must be beside the header", STATUS_FORMAT},
        {NRRD "endian: middle\n\n", "endian must be little or big, not 'middle'", STATUS_FORMAT},
        {NRRD "spacings: 1 2\n\n", "spacings are not three positive numbers", STATUS_FORMAT},
        {NRRD "spacings: 1 inf 1\n\n", "spacings are not three positive numbers", STATUS_FORMAT},
        {NRRD "space directions: (1,0,0) (0,1,0)\n\n", "space directions are not three vectors", STATUS_FORMAT},
        {NRRD "space directions: (1,0,0) (0,1,0) (0,0,inf)\n\n", "space directions are not three vectors",
         STATUS_FORMAT},
        {NRRD "space directions: (1,0,0) (0,1 0,0) (0,0,1)\n\n", "space directions are not three vectors",
         STATUS_FORMAT},
        {NRRD "space directions: (1,0,0) (0,1,0,0) (0,0,1)\n\n", "space directions are not three vectors",
         STATUS_FORMAT},
        {NRRD "space directions: (1,0,0) (0,0,0) (0,0,1)\n\n", "a space direction has no length", STATUS_FORMAT},
        {NRRD "units: \"mm\" \"mm\"\n\n", "units are not three quoted words", STATUS_FORMAT},
        {NRRD "units: \"mm\" \"mm\" \"mmm\"\n\n", "unknown unit", STATUS_FORMAT},
        {NRRD "line skip: -1\n\n", "a skip is not valid", STATUS_FORMAT},
        {NRRD "byte skip: 1x\n\n", "a skip is not valid", STATUS_FORMAT},
        {NRRD "byte skip: x\n\n", "a skip is not valid", STATUS_FORMAT},
        {NRRD "byte skip: 1099511627777\n\n", "a skip is not valid", STATUS_FORMAT},
        {NRRD "byte skip: 99999999999999999999\n\n", "a skip is not valid", STATUS_FORMAT},
        {NRRD "encoding: gzip\nbyte skip: -1\n\n", "compressed data cannot have byte skip", STATUS_FORMAT},
        {"NRRD0004\ntype: uchar\nsizes: 2 1 2\nencoding: raw\n\n", "the header lacks 'dimension'", STATUS_FORMAT},
        {"NRRD0004\ntype: uchar\ndimension: 3\nencoding: raw\n\n", "the header lacks 'sizes'", STATUS_FORMAT},
        {"NRRD0004\ndimension: 3\nsizes: 2 1 2\nencoding: raw\n\n", "the header lacks 'type'", STATUS_FORMAT},
        {"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 1 2\n\n", "the header lacks 'encoding'", STATUS_FORMAT},
        {"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 1 2 5\nencoding: raw\n\n", "sizes are not", STATUS_FORMAT},
        {"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 0 2\nencoding: raw\n\n", "sizes are not", STATUS_FORMAT},
        {"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 1 1048577\nencoding: raw\n\n", "sizes are not", STATUS_FORMAT},
    };
    for (size_t i = 0; i < sizeof check / sizeof *check; i++)
        refuse(state, "bad.nrrd", check[i].header, check[i].code, check[i].part);
}

static void test_refused_metaimage(void **state)
{
    static const struct {
        const char *header, *part;
        status code;
    } check[] = {
        {META "ElementDataFile = LIST\n", "data in a list of files is not supported", STATUS_UNSUPPORTED},
        {META "ElementDataFile = a%03d.raw 1 2 1\n", "data in a list of files is not supported", STATUS_UNSUPPORTED},
        {META "ElementDataFile = ../a.raw\n", "ElementDataFile must be a file beside the header", STATUS_FORMAT},
        {META "ElementDataFile =\n", "ElementDataFile must be a file beside the header", STATUS_FORMAT},
        {META "BinaryData = False\nElementDataFile = LOCAL\n", "data as text is not supported", STATUS_FORMAT},
        {META "ElementNumberOfChannels = 3 x\nElementDataFile = LOCAL\n", "is not a number from 1 to 64: '3 x'",
         STATUS_FORMAT},
        {META "HeaderSize = x\nElementDataFile = LOCAL\n", "HeaderSize is not valid", STATUS_FORMAT},
        {META "HeaderSize = -2\nElementDataFile = LOCAL\n", "HeaderSize is not valid", STATUS_FORMAT},
        {META "ElementSpacing = 1 0 1\nElementDataFile = LOCAL\n", "ElementSpacing is not three", STATUS_FORMAT},
        {META "ElementSpacing = 1 inf 1\nElementDataFile = LOCAL\n", "ElementSpacing is not three", STATUS_FORMAT},
        {META "ElementSpacing = 1 2\nElementDataFile = LOCAL\n", "ElementSpacing is not three", STATUS_FORMAT},
        {META "TransformMatrix = 1 0 0 0 1 0 0 0\nElementDataFile = LOCAL\n", "TransformMatrix is not a square",
         STATUS_FORMAT},
        {META "ElementType = MET_LONG\nElementDataFile = LOCAL\n", "unsupported ElementType 'MET_LONG'", STATUS_FORMAT},
        {META "NDims = 2\nElementDataFile = LOCAL\n", "NDims must be 3 or 4, not '2'", STATUS_FORMAT},
        {META "DimSize = 2 1\nElementDataFile = LOCAL\n", "DimSize is not three positive numbers", STATUS_FORMAT},
        {META, "the header lacks 'ElementDataFile'", STATUS_FORMAT},
        {"NDims = 3\nDimSize = 2 1 2\nElementDataFile = LOCAL\n", "the header lacks 'ElementType'", STATUS_FORMAT},
        {"NDims = 3\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n", "the header lacks 'DimSize'", STATUS_FORMAT},
    };
    for (size_t i = 0; i < sizeof check / sizeof *check; i++)
        refuse(state, "bad.mha", check[i].header, check[i].code, check[i].part);
}

/* Keys in any spacing, both names of the byte order, data behind other bytes of a file beside the header. */
static void test_metaimage_keys(void **state)
{
    static const uint8_t data[] = {7, 7, 0, 1, 1, 0, 255, 255, 128, 0};
    static const float big[4] = {1, 256, 65535, 32768};
    static const char *const order[] = {"ElementByteOrderMSB", "BinaryDataByteOrderMSB"}, *const yes[] = {"True",
                                                                                                          "true", "1"};
    static const char *const skip[] = {"HeaderSize = 2", "HeaderSize = -1"};
    char header[400];
    const char *paths[2] = {scratch_path(state, "k.mhd"), scratch_path(state, "k.raw")};
    scratch_write(paths[1], data, sizeof data);
    for (size_t i = 0; i < 12; i++) {
        snprintf(header, sizeof header,
                 "ObjectType = Image\n\tNDims =3\nDimSize= 2 1 2 \r\n%s = %s\n%s\nElementType   =   "
                 "MET_USHORT\nElementDataFile = k.raw\n",
                 order[i % 2], yes[i / 2 % 3], skip[i / 6]);
        scratch_write(paths[0], header, strlen(header));
        scan_expect_values(paths, 1 + i % 2, NULL, n, unknown, big);
    }
    const char *other[2] = {paths[0], scratch_path(state, "other.raw")};
    scratch_write(other[1], data, sizeof data);
    struct error err = {0};
    struct volume_source *s = NULL;
    assert_int_equal(volume_source_open(other, 2, &s, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, "its ElementDataFile is not 'other.raw'"));
}

/* A header ends within 64 KiB, and within lines of 4 KiB. */
static void test_long_headers(void **state)
{
    static char header[90000];
    static const uint8_t data[4] = {0, 1, 128, 255};
    static const float want[4] = UNSIGNED_8;
    for (int lines = 600; lines <= 700; lines += 100) {
        size_t at = (size_t)snprintf(header, sizeof header, "%s", NRRD);
        for (int i = 0; i < lines; i++) at += (size_t)snprintf(header + at, sizeof header - at, "# %097d\n", i);
        snprintf(header + at, sizeof header - at, "\n");
        if (lines == 600) {
            const char *path = write_file(state, "long.nrrd", header, data, 4);
            scan_expect_values(&path, 1, NULL, n, unknown, want);
        } else
            refuse(state, "long.nrrd", header, STATUS_FORMAT, "the header does not end within '65536 bytes'");
    }
    for (int width = 4000; width <= 4200; width += 200) {
        snprintf(header, sizeof header, "%s# %0*d\n\n", NRRD, width, 1);
        if (width == 4000) {
            const char *path = write_file(state, "wide.nrrd", header, data, 4);
            scan_expect_values(&path, 1, NULL, n, unknown, want);
        } else
            refuse(state, "wide.nrrd", header, STATUS_FORMAT, "the header does not end within");
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_types),          cmocka_unit_test(test_units),
        cmocka_unit_test(test_refused_nrrd),   cmocka_unit_test(test_refused_metaimage),
        cmocka_unit_test(test_metaimage_keys), cmocka_unit_test(test_long_headers),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
