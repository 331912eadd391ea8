/* NRRD scans: golden bytes of every type and order, compressed and detached data, and wrong headers. */
#include "base/option_id.h"
#include "tests/support/scan/scan_expectation.h"
#include "tests/support/scratch_folder.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include <cmocka.h>

#define HEAD "NRRD0004\n# a comment\ntype: "
#define SIZES "\ndimension: 3\nsizes: 2 1 2\n"

static void refuse_header(void **state, const char *header, const char *part)
{
    uint8_t file[4096], data[16];
    memset(data, 'x', sizeof data);
    const char *path = scratch_path(state, "bad.nrrd");
    scratch_write(path, file, scan_join_header(file, header, data, sizeof data));
    scan_expect_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, part);
}

static void test_nrrd_types_and_orders(void **state)
{
    static const struct {
        const char *header;
        uint8_t data[16];
        size_t n_data;
        float value[4];
    } golden[] = {
        {HEAD "uint8" SIZES "encoding: raw\n\n", {0, 1, 128, 255}, 4, {0, 1, 128, 255}},
        {HEAD "unsigned short" SIZES "endian: little\nencoding: raw\n\n",
         {1, 0, 0, 1, 255, 255, 2, 1},
         8,
         {1, 256, 65535, 258}},
        {HEAD "ushort" SIZES "endian: big\nencoding: raw\n\n", {0, 1, 1, 0, 255, 255, 1, 2}, 8, {1, 256, 65535, 258}},
        {HEAD "int16" SIZES "endian: big\nencoding: raw\n\n", {0, 1, 1, 0, 255, 255, 128, 0}, 8, {1, 256, -1, -32768}},
        {HEAD "float" SIZES "endian: little\nencoding: raw\n\n",
         {0, 0, 128, 63, 0, 0, 0, 191, 0, 0, 0, 0, 0, 0, 0, 64},
         16,
         {1, -0.5f, 0, 2}},
        {HEAD "float" SIZES "endian: big\nencoding: raw\n\n",
         {63, 128, 0, 0, 191, 0, 0, 0, 0, 0, 0, 0, 64, 0, 0, 0},
         16,
         {1, -0.5f, 0, 2}},
    };
    static const size_t n[3] = {2, 1, 2};
    static const double none[3] = {0, 0, 0};
    const char *path = scratch_path(state, "a.nrrd");
    uint8_t file[1024];
    for (size_t i = 0; i < sizeof golden / sizeof *golden; i++) {
        scratch_write(path, file, scan_join_header(file, golden[i].header, golden[i].data, golden[i].n_data));
        scan_expect_values(&path, 1, NULL, n, none, golden[i].value);
    }
}

static void test_nrrd_gzip_and_skips(void **state)
{
    static const uint8_t data[8] = {9, 9, 0, 1, 0, 2, 255, 3};
    static const size_t n[3] = {2, 1, 2};
    static const double mm[3] = {0.002, 0.002, 0.004};
    static const float want[4] = {0, 1, 0, 2};
    uint8_t file[1024], packed[256];
    const char *path = scratch_path(state, "z.nrrd");
    size_t n_packed = scan_gzip(data, 6, packed, sizeof packed);
    scratch_write(path, file,
                  scan_join_header(file,
                                   HEAD "uchar" SIZES "byte skip: 2\nencoding: gzip\nspacings: 0.002 0.002 0.004\n\n",
                                   packed, n_packed));
    scan_expect_values(&path, 1, NULL, n, mm, want);
    n_packed = scan_gzip(data + 2, 2, packed, sizeof packed); /* two members, as written by pigz or by appending */
    n_packed += scan_gzip(data + 4, 2, packed + n_packed, sizeof packed - n_packed);
    scratch_write(path, file,
                  scan_join_header(
                      file, HEAD "uchar" SIZES "encoding: gz\nspace units: \"um\" \"um\" \"um\"\nspacings: 2 2 4\n\n",
                      packed, n_packed));
    scan_expect_values(&path, 1, NULL, n, mm, want);
    scratch_write(path, file, scan_join_header(file, HEAD "uchar" SIZES "encoding: gzip\n\n", packed, n_packed - 12));
    scan_expect_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "ends or is damaged in slice 2");
    scratch_write(
        path, file,
        scan_join_header(file, HEAD "uchar\ndimension: 3\nsizes: 999 999 999\nencoding: gzip\n\n", packed, n_packed));
    scan_expect_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "too short");
    static const char head[] =
        HEAD "uchar" SIZES "encoding: gzip\n\n"; /* one superfluous row is an error, one byte is padding */
    for (size_t more = 0; more <= 2; more++) {
        n_packed = scan_gzip(data + 2, 4 + more, packed, sizeof packed);
        scratch_write(path, file, scan_join_header(file, head, packed, n_packed));
        if (more < 2)
            scan_expect_values(&path, 1, NULL, n, (const double[3]){0}, want);
        else
            scan_expect_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES,
                                "'z.nrrd' continues after the 2 x 1 x 2 uint8 voxels of its header");
    }
    n_packed = scan_gzip(data + 2, 4, packed,
                         sizeof packed); /* a second member is part of the data, zeros after the first are not */
    scratch_write(path, file,
                  scan_join_header(file, head, packed,
                                   n_packed + scan_gzip(data, 2, packed + n_packed, sizeof packed - n_packed)));
    scan_expect_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "continues after");
    memset(packed + n_packed, 0, 100);
    scratch_write(path, file, scan_join_header(file, head, packed, n_packed + 100));
    scan_expect_values(&path, 1, NULL, n, (const double[3]){0}, want);
}

static void test_nrrd_detached(void **state)
{
    static const uint8_t data[] = "text\nmore\n\0\1\0\2";
    static const size_t n[3] = {2, 1, 2};
    static const double mm[3] = {0.005, 0.002, 0.001};
    static const float want[4] = {0, 1, 0, 2};
    static const char *const header[] = {
        HEAD "uchar" SIZES "encoding: raw\ndata file: voxels.raw\nline skip: 2\nspace directions: (0.003,0.004,0) "
             "(0,-0.002,0) (0,0,0.001)\n",
        HEAD "uchar" SIZES
             "encoding: raw\nbyte skip: -1\nunits: \"um\" \"um\" \"um\"\nspacings: 5 2 1\ndatafile: ./voxels.raw\n\n",
        HEAD "uchar" SIZES
             "encoding: raw\nbyte skip: 10\nspacings: 5e-3 2e-3 1e-3\ndata file: voxels.raw\nkey:=value\n\n",
    };
    const char *path[2] = {scratch_path(state, "d.nhdr"), scratch_path(state, "voxels.raw")};
    scratch_write(path[1], data, sizeof data - 1);
    for (size_t i = 0; i < 3; i++) {
        scratch_write(path[0], header[i], strlen(header[i]));
        scan_expect_values(path, 1 + i % 2, NULL, n, mm, want);
    }
    scratch_write(path[0], HEAD "uchar" SIZES "encoding: raw\ndata file: gone.raw\n",
                  strlen(HEAD "uchar" SIZES "encoding: raw\ndata file: gone.raw\n"));
    scan_expect_refused(path[0], NULL, STATUS_NOT_FOUND, OPTION_SCAN_FILES, "'gone.raw' is missing");
}

static void test_nrrd_refused(void **state)
{
    refuse_header(state, HEAD "uchar" SIZES "encoding: raw\n", "no empty line");
    refuse_header(state, HEAD "block" SIZES "encoding: raw\n\n", "unsupported type 'block'");
    refuse_header(state, HEAD "uchar\ndimension: 2\nsizes: 2 2\nencoding: raw\n\n", "dimension must be 3");
    refuse_header(state, HEAD "uchar\ndimension: 3\nsizes: 2 1\nencoding: raw\n\n", "sizes");
    refuse_header(state, HEAD "uchar\ndimension: 3\nsizes: 2 -1 2\nencoding: raw\n\n", "sizes");
    refuse_header(state, HEAD "uchar\ndimension: 3\nsizes: 2 1 99999999999\nencoding: raw\n\n", "sizes");
    refuse_header(state, HEAD "ushort" SIZES "encoding: raw\n\n", "lacks 'endian'");
    refuse_header(state, HEAD "uchar" SIZES "\n", "lacks");
    refuse_header(state, HEAD "uchar" SIZES "encoding: raw\ndata file: ../x.raw\n\n", "beside the header");
    refuse_header(state, HEAD "uchar" SIZES "encoding: raw\nspacings: 1 0 1\n\n", "spacings");
    refuse_header(state, HEAD "uchar" SIZES "encoding: raw\nspace directions: (1,0,0) (0,x,0) (0,0,1)\n\n",
                  "space directions");
    refuse_header(state, HEAD "uchar" SIZES "encoding: raw\nunits: \"mm\" \"ft\" \"mm\"\n\n", "unknown unit");
    refuse_header(state, HEAD "uchar" SIZES "encoding: raw\nbyte skip: -2\n\n", "skip");
    refuse_header(state, HEAD "double" SIZES "endian: little\nencoding: raw\n\n", "too short");
    refuse_header(state, HEAD "uchar" SIZES "encoding: raw\n\n",
                  "which fits uint32, int32, float32"); /* 16 bytes for 4 voxels */
    uint8_t file[256], data[4] = {0};
    const char *path = scratch_path(state, "e.nrrd");
    scratch_write(path, file, scan_join_header(file, HEAD "uchar" SIZES "encoding: bzip2\n\n", data, 4));
    scan_expect_refused(path, NULL, STATUS_UNSUPPORTED, OPTION_SCAN_FILES, "'bzip2'");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_nrrd_types_and_orders),
        cmocka_unit_test(test_nrrd_gzip_and_skips),
        cmocka_unit_test(test_nrrd_detached),
        cmocka_unit_test(test_nrrd_refused),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
