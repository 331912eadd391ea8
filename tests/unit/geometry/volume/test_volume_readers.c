/* Readers of scans: golden bytes of raw, MetaImage and .vol, the registry of readers, and wrong headers. */
#include "base/option_id.h"
#include "geometry/reconstruct/reconstruct.h"
#include "geometry/volume/format/vol_file.h"
#include "geometry/volume/format/volume_reader.h"
#include "geometry/volume/format/volume_source.h"
#include "tests/support/scan/scan_expectation.h"
#include "tests/support/scratch_folder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void test_raw(void **state)
{
    static const uint8_t data[10] = {'h', 'd', 0, 1, 1, 0, 255, 255, 1, 2};
    static const float want[4] = {1, 256, 65535, 258};
    static const double none[3] = {0, 0, 0};
    struct volume_raw_declaration raw = {.n = {2, 1, 2}, .type = "uint16", .big_endian = true, .header_bytes = 2};
    const char *path = scratch_path(state, "s.raw");
    scratch_write(path, data, sizeof data);
    scan_expect_values(&path, 1, &raw, raw.n, none, want);
    scan_expect_refused(path, NULL, STATUS_UNSUPPORTED, OPTION_SCAN_FILES, OPTION_RAW);
    raw.header_bytes = 3;
    scan_expect_refused(path, &raw, STATUS_FORMAT, OPTION_SCAN_FILES, "too short");
    raw.header_bytes = 2;
    snprintf(raw.type, sizeof raw.type, "uint8");
    scan_expect_refused(path, &raw, STATUS_FORMAT, OPTION_SCAN_FILES, "which fits uint16, int16");
    snprintf(raw.type, sizeof raw.type, "bits");
    scan_expect_refused(path, &raw, STATUS_INVALID, OPTION_RAW_TYPE, "'bits'");
    raw.header_bytes = (size_t)1 << 62;
    snprintf(raw.type, sizeof raw.type, "uint8");
    scan_expect_refused(path, &raw, STATUS_FORMAT, OPTION_SCAN_FILES, "too short");
    raw.header_bytes = SIZE_MAX; /* as a signed offset it would mean the end of the file */
    scan_expect_refused(path, &raw, STATUS_INVALID, OPTION_RAW_HEADER, "is not possible");
    raw.header_bytes = 2;
    raw.n[1] = 0;
    scan_expect_refused(path, &raw, STATUS_INVALID, OPTION_RAW_SHAPE, "2 x 0 x 2");
    raw.n[1] = (1u << 20) + 1;
    scan_expect_refused(path, &raw, STATUS_INVALID, OPTION_RAW_SHAPE, "2 x 1048577 x 2");
}

/* The first bytes of the files of each reader, and of a file that no reader takes. */
static const struct {
    char id[16], byte[16];
} beginning[] = {{"tiff.v1", "II*"},           {"metaimage.v1", "NDims = 3\n"},  {"nrrd.v1", "NRRD0004\n"},
                 {"vol.v1", "VOL\3"},          {"npy.v1", "\x93NUMPY\1"},        {"nifti.v1", "\x5c\1"},
                 {"dicom.v1", "\2\0\0\0UL\4"}, {"hdf5.v1", "\x89HDF\r\n\x1a\n"}, {"", "hello, there"}};

static const char *beginning_of(const char *reader_id)
{
    for (size_t k = 0; k < sizeof beginning / sizeof beginning[0]; k++)
        if (strcmp(beginning[k].id, reader_id) == 0) return beginning[k].byte;
    fail_msg("state in 'beginning' how files of %s begin", reader_id);
    return NULL;
}

/* Every reader of the registry has a unique id with a version, takes only its own kind of file, and refuses a truncated
 * one. */
static void test_registry(void **state)
{
    for (size_t i = 0; i < volume_reader_count(); i++) {
        const volume_reader *r = volume_reader_at(i);
        const char *begin = beginning_of(r->id);
        const char *version = strrchr(r->id, '.'), *path = scratch_path(state, "cut.short");
        assert_true(version != NULL && version[1] == 'v' && version[2] >= '1' && version[2] <= '9');
        for (size_t k = 0; k < i; k++) assert_string_not_equal(r->id, volume_reader_at(k)->id);
        for (size_t k = 0; k < sizeof beginning / sizeof beginning[0]; k++)
            if (r->recognise((const uint8_t *)beginning[k].byte, "scan") != (beginning[k].byte == begin))
                fail_msg("%s and '%s'", r->id, beginning[k].byte);
        scratch_write(path, begin, 4);
        void *handle = NULL;
        struct volume_source_info info;
        struct error err = {0};
        assert_int_equal(r->open(&path, 1, NULL, &handle, &info, &err), STATUS_FORMAT);
        if (strstr(err.text, "'cut.short'") == NULL || strcmp(err.field, OPTION_SCAN_FILES) != 0)
            fail_msg("%s: %s", r->id, err.text);
        assert_null(handle);
    }
}

/* With swapped bytes a scan looks like noise and is refused. A scan that is noise in both byte orders, or has only
 * multiples of 256, is not refused. */
static void test_wrong_byte_order(void **state)
{
    enum { N = 32 };
    static uint8_t picture[N * N * 2], noise[N * N * 2], coarse[N * N * 2];
    uint32_t x = 1;
    for (int i = 0; i < N * N; i++) {
        unsigned v = (unsigned)(30000.0 + 20000.0 * sin(0.3 * (i % N)) + 1000.0 * cos(0.2 * (i / N)));
        picture[2 * i] = (uint8_t)(v >> 8);
        picture[2 * i + 1] = (uint8_t)v;
        for (int b = 0; b < 2; b++) noise[2 * i + b] = (uint8_t)((x = x * 1664525u + 1013904223u) >> 24);
        coarse[2 * i] = (uint8_t)(v >> 8);
    }
    struct volume_raw_declaration raw = {.n = {N, N, 1}, .type = "uint16"};
    const char *path = scratch_path(state, "o.raw");
    struct volume_source *source;
    scratch_write(path, picture, sizeof picture);
    scan_expect_refused(path, &raw, STATUS_FORMAT, OPTION_SCAN_FILES, "stated byte order is wrong");
    for (int i = 0; i < 5; i++) { /* the right order; noise and coarse values in both */
        raw.big_endian = i % 2 == 0;
        if (i > 0) scratch_write(path, i < 3 ? noise : coarse, sizeof noise);
        assert_int_equal(volume_source_open_declared(&path, 1, &raw, NULL, &source, NULL), STATUS_OK);
        volume_source_close(source);
    }
}

/* Values that are no numbers in the stated byte order, and a picture in the other. */
static void test_wrong_byte_order_of_floats(void **state)
{
    enum { N = 32 };
    static float picture[N * N];
    for (uint32_t i = 0; i < N * N; i++) { /* the low bytes are the exponent of the other order: all ones */
        uint32_t bits = (0x3f800000u + (i % N << 16)) | 0xff7fu;
        memcpy(&picture[i], &bits, sizeof bits);
    }
    struct volume_raw_declaration raw = {.n = {N, N, 1}, .type = "float32", .big_endian = true};
    const char *path = scratch_path(state, "f.raw");
    scratch_write(path, (const uint8_t *)picture, sizeof picture);
    scan_expect_refused(path, &raw, STATUS_FORMAT, OPTION_SCAN_FILES, "stated byte order is wrong");
}

static void test_metaimage(void **state)
{
    static const uint8_t data[8] = {1, 0, 0, 1, 255, 255, 2, 1};
    static const size_t n[3] = {2, 1, 2};
    static const double mm[3] = {0.002, 0.003, 0.004};
    static const float want[4] = {1, 256, 65535, 258};
    static const char head[] = "ObjectType = Image\nNDims = 3\nDimSize = 2 1 2\nElementSpacing = 0.002 0.003 "
                               "0.004\nElementType = MET_USHORT\n";
    uint8_t file[1024], packed[256];
    char header[512];
    const char *path = scratch_path(state, "m.mha");
    snprintf(header, sizeof header, "%sElementDataFile = LOCAL\n", head);
    scratch_write(path, file, scan_join_header(file, header, data, sizeof data));
    scan_expect_values(&path, 1, NULL, n, mm, want);
    scratch_write(path, file, scan_join_header(file, header, data, sizeof data - 1));
    scan_expect_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "too short");
    snprintf(header, sizeof header, "%sCompressedData = True\nElementDataFile = LOCAL\n", head);
    scratch_write(path, file,
                  scan_join_header(file, header, packed, scan_gzip(data, sizeof data, packed, sizeof packed)));
    scan_expect_values(&path, 1, NULL, n, mm, want);
    const uint8_t longer[12] = {1, 0, 0, 1, 255, 255, 2, 1};
    scratch_write(path, file,
                  scan_join_header(file, header, packed, scan_gzip(longer, sizeof longer, packed, sizeof packed)));
    scan_expect_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "continues after");
}

static void test_metaimage_units(void **state)
{
    static const struct {
        const char *line;
        double mm;
    } unit[] = {{"", 2.0},
                {"DistanceUnits = ?\n", 2.0},
                {"DistanceUnits = mm\n", 2.0},
                {"DistanceUnits = um\n", 0.002},
                {"DistanceUnits = cm\n", 20.0}};
    static const size_t n[3] = {2, 1, 2};
    static const float want[4] = {1, 2, 3, 4};
    static const uint8_t data[4] = {1, 2, 3, 4};
    uint8_t file[1024];
    char header[512];
    const char *path = scratch_path(state, "u.mha");
    for (size_t i = 0; i < sizeof unit / sizeof unit[0]; i++)
        for (int after = 0; after < 2; after++) { /* lines have no order */
            snprintf(header, sizeof header,
                     "NDims = 3\nDimSize = 2 1 2\n%sElementSpacing = 2 2 2\n%sElementType = MET_UCHAR\nElementDataFile "
                     "= LOCAL\n",
                     after ? "" : unit[i].line, after ? unit[i].line : "");
            scratch_write(path, file, scan_join_header(file, header, data, sizeof data));
            scan_expect_values(&path, 1, NULL, n, (const double[3]){unit[i].mm, unit[i].mm, unit[i].mm}, want);
        }
    snprintf(header, sizeof header,
             "NDims = 3\nDimSize = 2 1 2\nDistanceUnits = inch\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n");
    scratch_write(path, file, scan_join_header(file, header, data, sizeof data));
    scan_expect_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "DistanceUnits must be um, mm or cm, not 'inch'");
}

static void test_vol(void **state)
{
    static const uint8_t golden[] = {0x56, 0x4f, 0x4c, 3, 1,    0,    0, 0, 2,    0,    0, 0, 1, 0, 0, 0, 1,    0,   0,
                                     0,    1,    0,    0, 0,    0,    0, 0, 0,    0,    0, 0, 0, 0, 0, 0, 0,    0,   0,
                                     0x80, 0x3f, 0,    0, 0x80, 0x3f, 0, 0, 0x80, 0x3f, 0, 0, 0, 0, 0, 0, 0x80, 0x3f};
    static const uint8_t quantised[] = {
        0x56, 0x4f, 0x4c, 3, 4, 0, 0, 0, 2, 0, 0, 0, 1,    0,    0, 0, 1,    0,    0, 0, 3,    0,    0,   0,   0,   0,
        0,    0,    0,    0, 0, 0, 0, 0, 0, 0, 0, 0, 0x80, 0x3f, 0, 0, 0x80, 0x3f, 0, 0, 0x80, 0x3f, 255, 255, 127, 0};
    static const size_t n[3] = {2, 1, 1};
    static const double mm[3] = {0.5, 1, 1};
    static const float want[2] = {0, 1};
    const char *path = scratch_path(state, "g.vol");
    uint8_t bad[sizeof golden], longer[sizeof golden + 8];
    scratch_write(path, golden, sizeof golden);
    scan_expect_values(&path, 1, NULL, n, mm, want);
    struct volume v;
    assert_int_equal(vol_read_density(path, &v, NULL), STATUS_OK);
    assert_int_equal(vol_write_density(path, &v, VOL_FLOAT32, NULL), STATUS_OK);
    volume_release(&v);
    size_t n_byte;
    char *bytes = scratch_read(path, &n_byte);
    assert_int_equal(n_byte, sizeof golden);
    assert_memory_equal(bytes, golden, n_byte);
    free(bytes);
    scratch_write(path, golden, sizeof golden - 1);
    scan_expect_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "need 56 bytes, but the file has 55");
    memset(longer, 0, sizeof longer);
    memcpy(longer, golden, sizeof golden);
    scratch_write(path, longer, sizeof golden + 7);
    scan_expect_values(&path, 1, NULL, n, mm, want);
    scratch_write(path, longer, sizeof golden + 8); /* a row more */
    scan_expect_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "need 56 bytes, but the file has 64");
    memcpy(bad, golden, sizeof bad);
    bad[11] = 0x7f;
    scratch_write(path, bad, sizeof bad);
    scan_expect_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "impossible size");
    scratch_write(path, quantised, sizeof quantised);
    scan_expect_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "directions, not densities");
    struct vol_header h;
    float *d;
    assert_int_equal(vol_read_direction(path, &h, &d, NULL), STATUS_OK);
    assert_true(d[0] == 0.0f && d[1] == 0.0f && d[2] == 0.0f && fabsf(d[3] - 1.0f) < 1e-4f && fabsf(d[4]) < 1e-6f);
    free(d);
}

/* The declaration of a raw file is used when a job reads its volume, and a voxel that is not a number is named in the
 * error. */
static void test_raw_in_a_job(void **state)
{
    enum { N = 12 };
    static float value[N * N * N];
    struct reconstruct_option o;
    struct reconstruct_report report = {0};
    struct volume v;
    struct error err = {0};
    struct thread_pool *pool = NULL;
    const char *path = scratch_path(state, "job.raw");
    for (size_t i = 0; i < N * N * N; i++) value[i] = i % N < 4 ? 300.0f : 100.0f;
    scratch_write(path, value, sizeof value);
    assert_int_equal(thread_pool_new(1, &pool, NULL), STATUS_OK);
    for (int nan = 0; nan < 2; nan++) {
        reconstruct_option_default(&o);
        o.raw = (struct volume_raw_declaration){.n = {N, N, N}, .type = "float32"};
        for (int a = 0; a < 3; a++) o.voxel_size_m[a] = 2e-6;
        status s = reconstruct_read(&path, 1, &o, NULL, pool, NULL, &v, &report, &err);
        if (s != (nan ? STATUS_INVALID : STATUS_OK) || (nan && strstr(err.text, "(4, 10, 4) is NaN") == NULL))
            fail_msg("%s", err.text);
        if (!nan) assert_true(v.n[2] == N && v.density[0] > 0.9f && v.density[8] < 0.1f);
        volume_release(&v);
        value[700] = NAN;
        scratch_write(path, value, sizeof value);
    }
    thread_pool_free(pool);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_raw),
        cmocka_unit_test(test_registry),
        cmocka_unit_test(test_wrong_byte_order),
        cmocka_unit_test(test_wrong_byte_order_of_floats),
        cmocka_unit_test(test_metaimage),
        cmocka_unit_test(test_metaimage_units),
        cmocka_unit_test(test_vol),
        cmocka_unit_test(test_raw_in_a_job),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
