/* Scans of programs for arrays and for medicine: .npy of NumPy, and NIfTI-1 and NIfTI-2. */
#include "base/option_id.h"
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

/* ---- .npy ---- */

static size_t npy(uint8_t *out, int version, const char *dictionary, const void *data, size_t n)
{
    const size_t n_text = strlen(dictionary), n_begin = version == 1 ? 10 : 12;
    memcpy(out, "\x93NUMPY", 6);
    memset(out + 6, 0, 6);
    out[6] = (uint8_t)version;
    out[8] = (uint8_t)(n_text & 255);
    out[9] = (uint8_t)(n_text >> 8);
    memcpy(out + n_begin, dictionary, n_text);
    memcpy(out + n_begin + n_text, data, n);
    return n_begin + n_text + n;
}

static void npy_refused(void **state, const char *dictionary, size_t n, const char *part)
{
    static const uint8_t zero[512];
    uint8_t file[2048];
    const char *path = scratch_path(state, "bad.npy");
    scratch_write(path, file, npy(file, 1, dictionary, zero, n));
    scan_expect_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, part);
}

static void test_npy(void **state)
{
    static const uint8_t data[12] = {1, 0, 0, 1, 255, 255, 2, 1, 0, 0, 7, 0};
    static const size_t n[3] = {1, 2, 3};
    static const double none[3] = {0, 0, 0};
    static const float little[6] = {1, 256, 65535, 258, 0, 7}, big[6] = {256, 1, 65535, 513, 0, 1792};
    uint8_t file[256];
    const char *path = scratch_path(state, "s.npy");
    for (int version = 1; version <= 3; version++) {
        scratch_write(
            path, file,
            npy(file, version, "{'descr': '<u2', 'fortran_order': False, 'shape': (3, 2, 1), }  \n", data, 12));
        scan_expect_values(&path, 1, NULL, n, none, little);
        scratch_write(path, file,
                      npy(file, version, "{\"shape\":(3,2,1),\"fortran_order\":False,\"descr\":\">u2\"}", data, 12));
        scan_expect_values(&path, 1, NULL, n, none, big);
    }
    scratch_write(path, file, npy(file, 4, "{'descr': '<u2', 'fortran_order': False, 'shape': (3, 2, 1)}", data, 12));
    scan_expect_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "version");
}

static void test_npy_types(void **state)
{
    static const struct {
        const char *name;
        size_t n_byte;
    } type[] = {{"|u1", 1}, {"|i1", 1}, {"|b1", 1}, {"<u2", 2}, {"<i2", 2},
                {"<u4", 4}, {"<i4", 4}, {"<f4", 4}, {"<f8", 8}};
    static const double none[3] = {0, 0, 0};
    const double f8[2] = {1, 0};
    const float f4[2] = {1, 0};
    for (size_t i = 0; i < sizeof type / sizeof *type; i++) {
        uint8_t file[256], whole[16] = {1};
        char text[128];
        const void *data = type[i].name[1] != 'f' ? (const void *)whole : type[i].n_byte == 4 ? (const void *)f4 : f8;
        const char *path = scratch_path(state, "t.npy");
        snprintf(text, sizeof text, "{'descr': '%s', 'fortran_order': False, 'shape': (1, 1, 2)}", type[i].name);
        scratch_write(path, file, npy(file, 1, text, data, 2 * type[i].n_byte));
        scan_expect_values(&path, 1, NULL, (const size_t[3]){2, 1, 1}, none, (const float[2]){1, 0});
    }
}

/* The array [z, y, x] is the same volume in both orders. */
static void test_npy_fortran(void **state)
{
    static const uint8_t data[6] = {1, 2, 3, 4, 5, 6};
    uint8_t file[256];
    struct volume_source *source = NULL;
    const char *path = scratch_path(state, "f.npy");
    scratch_write(path, file, npy(file, 1, "{'descr': '|u1', 'fortran_order': True, 'shape': (3, 2, 1)}", data, 6));
    assert_int_equal(volume_source_open(&path, 1, &source, NULL), STATUS_OK);
    const struct volume_source_info *info = volume_source_describe(source);
    assert_true(info->n[0] == 3 && info->n[1] == 2 && info->n[2] == 1);
    assert_string_equal(info->axes, "zyx");
    assert_non_null(file_ledger_find(&info->ledger, "directions of axes"));
    volume_source_close(source);
}

static void test_npy_parts(void **state)
{
    static const uint8_t data[8] = {1, 2, 3, 4, 5, 6, 7, 8};
    uint8_t file[256];
    float value[4];
    struct volume_source *source = NULL;
    const char *path = scratch_path(state, "c.npy");
    scratch_write(path, file, npy(file, 1, "{'descr': '|u1', 'fortran_order': False, 'shape': (2, 1, 2, 2)}", data, 8));
    scan_expect_refused(path, NULL, STATUS_INVALID, OPTION_SCAN_CHANNEL, "its shape says that it has 2 channels");
    const struct volume_part second = {.channel = 2};
    assert_int_equal(volume_source_open_declared(&path, 1, NULL, &second, &source, NULL), STATUS_OK);
    assert_int_equal(volume_source_read(source, 0, 1, value, NULL), STATUS_OK);
    assert_true(value[0] == 5.0f && value[3] == 8.0f);
    volume_source_close(source);
    npy_refused(state, "{'descr': '|u1', 'fortran_order': True, 'shape': (2, 1, 2, 2)}", 8, "ascontiguousarray");
}

static void test_npy_refused(void **state)
{
    static const struct {
        const char *text, *part;
    } c[] = {{"{'descr': '|u1', 'fortran_order': False, 'shape': (-1, 2, 2)}", "'shape'"},
             {"{'descr': '|u1', 'fortran_order': False, 'shape': (0, 2, 2)}", "'shape'"},
             {"{'descr': '|u1', 'fortran_order': False, 'shape': (2, 2)}", "'shape'"},
             {"{'descr': '|u1', 'fortran_order': False, 'shape': (99999999999999999999, 2, 2)}", "'shape'"},
             {"{'descr': '|u1', 'fortran_order': False, 'shape': (2, 2, 3)}", "too short"},
             {"{'descr': '|u1', 'fortran_order': False, 'shape': (2, 2, 1)}", "need 4 bytes"},
             {"{'descr': '|u1', 'fortran_order': False}", "lacks 'shape'"},
             {"{'descr': '|u1', 'shape': (2, 2, 2)}", "lacks 'fortran_order'"},
             {"{'descr': '|u1', 'fortran_order': Maybe, 'shape': (2, 2, 2)}", "neither True nor False"},
             {"{'descr': '|O', 'fortran_order': False, 'shape': (2, 2, 2)}", "objects"},
             {"{'descr': '<c8', 'fortran_order': False, 'shape': (2, 2, 2)}", "complex"},
             {"{'descr': '<M8[ns]', 'fortran_order': False, 'shape': (2, 2, 2)}", "times"},
             {"{'descr': '<i8', 'fortran_order': False, 'shape': (2, 2, 2)}", "'<i8'"},
             {"{'descr': '<f2', 'fortran_order': False, 'shape': (2, 2, 2)}", "'<f2'"},
             {"{'descr': [('a', '<u1')], 'fortran_order': False, 'shape': (2, 2, 2)}", "records"},
             {"{'descr': '|u1', 'other': 1}", "not understood"},
             {"{'descr': '|u1'", "not understood"},
             {"{'descr", "not understood"},
             {"", "no dictionary"}};
    for (size_t i = 0; i < sizeof c / sizeof *c; i++) npy_refused(state, c[i].text, 8, c[i].part);
}

/* ---- NIfTI ---- */

struct nifti_file {
    uint8_t byte[544 + 64];
    size_t n_header;
    bool big;
};

static void store(struct nifti_file *f, size_t at, size_t n, uint64_t bits)
{
    for (size_t i = 0; i < n; i++) f->byte[at + (f->big ? n - 1 - i : i)] = (uint8_t)(bits >> 8 * i);
}

static void store_real(struct nifti_file *f, size_t at, double x)
{
    const float single = (float)x;
    uint64_t wide;
    uint32_t narrow;
    memcpy(&wide, &x, sizeof wide);
    memcpy(&narrow, &single, sizeof narrow);
    store(f, at, f->n_header == 540 ? 8 : 4, f->n_header == 540 ? wide : narrow);
}

/* Fields in NIfTI-1 and in NIfTI-2. */
static size_t at(const struct nifti_file *f, size_t first, size_t second)
{
    return f->n_header == 540 ? second : first;
}

static void set_size(struct nifti_file *f, const int *size, int n)
{
    const size_t n_byte = at(f, 2, 8), first = at(f, 40, 16);
    store(f, first, n_byte, (uint64_t)n);
    for (int a = 0; a < n; a++) store(f, first + (size_t)(a + 1) * n_byte, n_byte, (uint64_t)size[a]);
}

static void set_reals(struct nifti_file *f, size_t first, size_t second, const double *x, size_t n)
{
    for (size_t i = 0; i < n; i++) store_real(f, at(f, first + 4 * i, second + 8 * i), x[i]);
}

/* A file of 2 x 2 x 2 voxels of type uint16, 1 .. 8, with edges of 2, 3, 4 micrometres. */
static struct nifti_file nifti(int version, bool big)
{
    struct nifti_file f = {.n_header = version == 2 ? 540 : 348, .big = big};
    const int size[3] = {2, 2, 2};
    const double pixdim[4] = {1, 2, 3, 4};
    store(&f, 0, 4, f.n_header);
    memcpy(f.byte + at(&f, 344, 4), version == 2 ? "n+2\0\r\n\x1a\n" : "n+1", version == 2 ? 8 : 4);
    set_size(&f, size, 3);
    store(&f, at(&f, 70, 12), 2, 512);
    store(&f, at(&f, 72, 14), 2, 16);
    set_reals(&f, 76, 104, pixdim, 4);
    if (version == 2)
        store(&f, 168, 8, f.n_header + 4);
    else
        store_real(&f, 108, (double)f.n_header + 4);
    store(&f, at(&f, 123, 500), at(&f, 1, 4), 3);
    for (size_t i = 0; i < 8; i++) store(&f, f.n_header + 4 + 2 * i, 2, i + 1);
    return f;
}

static const char *write_nifti(void **state, const struct nifti_file *f)
{
    const char *path = scratch_path(state, "s.nii");
    scratch_write(path, f->byte, f->n_header + 4 + 16);
    return path;
}

static const size_t cube[3] = {2, 2, 2};
static const double edge_mm[3] = {0.002, 0.003, 0.004};
static const float count[8] = {1, 2, 3, 4, 5, 6, 7, 8};

static void test_nifti(void **state)
{
    for (int k = 0; k < 4; k++) {
        const struct nifti_file f = nifti(1 + k / 2, k % 2 == 1);
        uint8_t packed[1024];
        const char *path = write_nifti(state, &f);
        scan_expect_values(&path, 1, NULL, cube, edge_mm, count);
        path = scratch_path(state, "s.nii.gz");
        scratch_write(path, packed, scan_gzip(f.byte, f.n_header + 20, packed, sizeof packed));
        scan_expect_values(&path, 1, NULL, cube, edge_mm, count);
        scratch_write(path, packed, scan_gzip(f.byte, f.n_header + 18, packed, sizeof packed));
        scan_expect_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "ends or is damaged");
    }
}

static void test_nifti_pair(void **state)
{
    struct nifti_file f = nifti(1, false);
    const char *path[2] = {strdup(scratch_path(state, "p.hdr")), strdup(scratch_path(state, "p.img"))};
    f.byte[345] = 'i';
    store_real(&f, 108, 0);
    scratch_write(path[0], f.byte, 348);
    scan_expect_refused(path[0], NULL, STATUS_NOT_FOUND, OPTION_SCAN_FILES, "'p.img' is missing");
    scratch_write(path[1], f.byte + 352, 16);
    scan_expect_values(path, 1, NULL, cube, edge_mm, count);
    scan_expect_values(path, 2, NULL, cube, edge_mm, count);
    scan_expect_refused(path[1], NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "name the header");
    memset(f.byte + 344, 0, 4);
    scratch_write(path[0], f.byte, 348);
    scan_expect_refused(path[0], NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "Analyze 7.5");
    free((char *)path[0]);
    free((char *)path[1]);
}

static void open_nifti(void **state, const struct nifti_file *f, struct volume_source_info *info, float value[8])
{
    const char *path = write_nifti(state, f);
    struct volume_source *source = NULL;
    struct error err = {0};
    if (volume_source_open(&path, 1, &source, &err) != STATUS_OK) fail_msg("%s", err.text);
    *info = *volume_source_describe(source);
    assert_int_equal(volume_source_read(source, 0, 2, value, NULL), STATUS_OK);
    volume_source_close(source);
}

static void expect_use(const struct volume_source_info *info, const char *name, enum file_statement_use use)
{
    const struct file_statement *s = file_ledger_find(&info->ledger, name);
    if (s == NULL || s->use != use) fail_msg("%s: %s", name, s == NULL ? "not stated" : s->reason);
}

static void test_nifti_statements(void **state)
{
    for (int version = 1; version <= 2; version++) {
        struct nifti_file f = nifti(version, version == 2);
        const double scale[2] = {-2, 10}, range[2] = {100, 1};
        struct volume_source_info info;
        float value[8];
        set_reals(&f, 112, 176, scale, 2);
        set_reals(&f, 124, 192, range, 2);
        memcpy(f.byte + at(&f, 148, 240), "made by hand", 12);
        store(&f, at(&f, 123, 500), at(&f, 1, 4), 0);
        open_nifti(state, &f, &info, value);
        assert_true(value[0] == 8.0f && value[7] == -6.0f && isnan(info.voxel_size_m[0]) && info.axes[0] == '\0');
        expect_use(&info, "scale of values", FILE_STATEMENT_APPLIED);
        expect_use(&info, "range of display", FILE_STATEMENT_NOT_USED);
        expect_use(&info, "description", FILE_STATEMENT_NOT_USED);
        expect_use(&info, "voxel size", FILE_STATEMENT_NOT_USED);
    }
}

static void test_nifti_directions(void **state)
{
    const double h = sqrt(0.5);
    const struct {
        int form; /* 1: qform, 2: sform */
        double q[3], side, srow[12];
        const char *axes;
    } c[] = {{1, {0, 0, 0}, 1, {0}, "xyz"},
             {1, {0, 0, 0}, -1, {0}, "xy-z"},
             {1, {0, 0, 1}, 1, {0}, "-x-yz"},
             {1, {0, 0, h}, 1, {0}, "-yxz"},
             {1, {0.1, 0, 0}, 1, {0}, ""},
             {2, {0}, 1, {-2, 0, 0, 9, 0, 3, 0, 8, 0, 0, 4, 7}, "-xyz"},
             {2, {0}, 1, {0, 0, 4, 0, 2, 0, 0, 0, 0, 3, 0, 0}, "zxy"},
             {2, {0}, 1, {2, 1, 0, 0, 0, 2.8284271247, 0, 0, 0, 0, 4, 0}, ""}};
    for (size_t i = 0; i < sizeof c / sizeof *c; i++)
        for (int version = 1; version <= 2; version++) {
            struct nifti_file f = nifti(version, i % 2 == 0);
            struct volume_source_info info;
            float value[8];
            store(&f, at(&f, c[i].form == 1 ? 252 : 254, c[i].form == 1 ? 344 : 348), at(&f, 2, 4), 1);
            set_reals(&f, 76, 104, &c[i].side, 1);
            set_reals(&f, 256, 352, c[i].q, 3);
            set_reals(&f, 280, 400, c[i].srow, 12);
            open_nifti(state, &f, &info, value);
            if (strcmp(info.axes, c[i].axes) != 0 || info.is_oblique != (c[i].axes[0] == '\0'))
                fail_msg("case %zu: '%s'", i, info.axes);
            assert_true(fabs(info.voxel_size_m[2] - 4e-6) < 1e-12);
            if (i == 5) expect_use(&info, "origin", FILE_STATEMENT_NOT_USED);
        }
    struct nifti_file f = nifti(1, false);
    struct volume_source_info info;
    float value[8];
    const double other[12] = {5, 0, 0, 0, 0, 5, 0, 0, 0, 0, 5, 0};
    store(&f, 254, 2, 1);
    set_reals(&f, 280, 400, other, 12);
    open_nifti(state, &f, &info, value);
    assert_true(isnan(info.voxel_size_m[0]));
    expect_use(&info, "voxel size", FILE_STATEMENT_NOT_USED);
}

static void test_nifti_refused(void **state)
{
    struct nifti_file f = nifti(1, false);
    const int four[4] = {2, 2, 1, 2}, negative[3] = {2, -2, 2}, huge[3] = {32767, 32767, 32767};
    set_size(&f, four, 4);
    scan_expect_refused(write_nifti(state, &f), NULL, STATUS_INVALID, OPTION_SCAN_TIME, "it has 2 times");
    f = nifti(1, false);
    set_size(&f, negative, 3);
    scan_expect_refused(write_nifti(state, &f), NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "impossible size");
    set_size(&f, huge, 3);
    scan_expect_refused(write_nifti(state, &f), NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "too short");
    static const struct {
        int code;
        const char *part;
    } type[] = {{128, "RGB"},       {2304, "RGBA"},  {32, "complex"},
                {1, "single bits"}, {1024, "int64"}, {77, "datatype 77"}};
    for (size_t i = 0; i < sizeof type / sizeof *type; i++) {
        f = nifti(1, false);
        store(&f, 70, 2, (uint64_t)type[i].code);
        scan_expect_refused(write_nifti(state, &f), NULL, STATUS_FORMAT, OPTION_SCAN_FILES, type[i].part);
    }
    const double offset[] = {-1, 100, NAN, 1e30};
    for (size_t i = 0; i < sizeof offset / sizeof *offset; i++) {
        f = nifti(1, false);
        store_real(&f, 108, offset[i]);
        scan_expect_refused(write_nifti(state, &f), NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "vox_offset");
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_npy),
        cmocka_unit_test(test_npy_types),
        cmocka_unit_test(test_npy_fortran),
        cmocka_unit_test(test_npy_parts),
        cmocka_unit_test(test_npy_refused),
        cmocka_unit_test(test_nifti),
        cmocka_unit_test(test_nifti_pair),
        cmocka_unit_test(test_nifti_statements),
        cmocka_unit_test(test_nifti_directions),
        cmocka_unit_test(test_nifti_refused),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
