/* Readers of scans: golden bytes of NRRD, raw, MetaImage and .vol, and headers that lie. */
#include "base/option_id.h"
#include "geometry/reconstruct.h"
#include "geometry/volume/vol_file.h"
#include "geometry/volume/volume_reader.h"
#include "geometry/volume/volume_source.h"
#include "tests/support/scratch_folder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include <cmocka.h>

#define HEAD "NRRD0004\n# a comment\ntype: "
#define SIZES "\ndimension: 3\nsizes: 2 1 2\n"

static size_t join(uint8_t *out, const char *header, const void *data, size_t n_data)
{
    size_t n = strlen(header);
    memcpy(out, header, n);
    memcpy(out + n, data, n_data);
    return n + n_data;
}

/* Opens path[0..n_path) and compares shape, spacing (millimetres; 0: unknown) and values. */
static void check_values(const char *const *path, size_t n_path, const struct volume_raw_declaration *raw,
                         const size_t n[3], const double spacing_mm[3], const float *want)
{
    struct volume_source *source;
    struct error err = {0};
    if (volume_source_open_declared(path, n_path, raw, &source, &err) != STATUS_OK) fail_msg("%s", err.text);
    const struct volume_source_info *info = volume_source_describe(source);
    size_t n_voxel = n[0] * n[1] * n[2], n_slice = n[0] * n[1];
    float *value = calloc(n_voxel, sizeof *value);
    for (int a = 0; a < 3; a++) {
        assert_int_equal(info->n[a], n[a]);
        if (spacing_mm[a] > 0.0)
            assert_true(fabs(info->voxel_size_m[a] - spacing_mm[a] * 1e-3) < 1e-12);
        else
            assert_true(isnan(info->voxel_size_m[a]));
    }
    for (int pass = 0; pass < 2; pass++) { /* all at once, then slices backwards */
        memset(value, 0, n_voxel * sizeof *value);
        for (size_t k = n[2]; k > 0 && pass == 1; k--)
            if (volume_source_read(source, k - 1, 1, value + (k - 1) * n_slice, &err) != STATUS_OK)
                fail_msg("%s", err.text);
        if (pass == 0 && volume_source_read(source, 0, n[2], value, &err) != STATUS_OK) fail_msg("%s", err.text);
        for (size_t i = 0; i < n_voxel; i++) assert_true(value[i] == want[i]);
    }
    free(value);
    volume_source_close(source);
}

static void check_refused(const char *path, const struct volume_raw_declaration *raw, status code, const char *field,
                          const char *part)
{
    struct volume_source *source = NULL;
    struct error err = {0};
    status s = volume_source_open_declared(&path, 1, raw, &source, &err);
    float value[4096];
    if (s == STATUS_OK) { /* damage of compressed data shows when it is read */
        const struct volume_source_info *info = volume_source_describe(source);
        for (size_t k = 0; k < info->n[2] && s == STATUS_OK && info->n[0] * info->n[1] <= 4096; k++)
            s = volume_source_read(source, k, 1, value, &err);
        volume_source_close(source);
    }
    if (s != code || strcmp(err.field, field) != 0 || strstr(err.text, part) == NULL)
        fail_msg("'%s' wanted, got %s, field '%s': %s", part, status_name(s), err.field, err.text);
}

static void refuse_header(void **state, const char *header, const char *part)
{
    uint8_t file[4096], data[16];
    memset(data, 'x', sizeof data);
    const char *path = scratch_path(state, "bad.nrrd");
    scratch_write(path, file, join(file, header, data, sizeof data));
    check_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, part);
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
        scratch_write(path, file, join(file, golden[i].header, golden[i].data, golden[i].n_data));
        check_values(&path, 1, NULL, n, none, golden[i].value);
    }
}

static size_t gzip(const uint8_t *data, size_t n, uint8_t *out, size_t n_out)
{
    z_stream z = {0};
    assert_int_equal(deflateInit2(&z, 9, Z_DEFLATED, 16 + MAX_WBITS, 8, Z_DEFAULT_STRATEGY), Z_OK);
    z.next_in = (uint8_t *)(uintptr_t)data;
    z.avail_in = (uInt)n;
    z.next_out = out;
    z.avail_out = (uInt)n_out;
    assert_int_equal(deflate(&z, Z_FINISH), Z_STREAM_END);
    size_t used = z.total_out;
    deflateEnd(&z);
    return used;
}

static void test_nrrd_gzip_and_skips(void **state)
{
    static const uint8_t data[8] = {9, 9, 0, 1, 0, 2, 255, 3};
    static const size_t n[3] = {2, 1, 2};
    static const double mm[3] = {0.002, 0.002, 0.004};
    static const float want[4] = {0, 1, 0, 2};
    uint8_t file[1024], packed[256];
    const char *path = scratch_path(state, "z.nrrd");
    size_t n_packed = gzip(data, 6, packed, sizeof packed);
    scratch_write(path, file,
                  join(file, HEAD "uchar" SIZES "byte skip: 2\nencoding: gzip\nspacings: 0.002 0.002 0.004\n\n", packed,
                       n_packed));
    check_values(&path, 1, NULL, n, mm, want);
    n_packed = gzip(data + 2, 2, packed, sizeof packed); /* two members, as written by pigz or by appending */
    n_packed += gzip(data + 4, 2, packed + n_packed, sizeof packed - n_packed);
    scratch_write(path, file,
                  join(file, HEAD "uchar" SIZES "encoding: gz\nspace units: \"um\" \"um\" \"um\"\nspacings: 2 2 4\n\n",
                       packed, n_packed));
    check_values(&path, 1, NULL, n, mm, want);
    scratch_write(path, file, join(file, HEAD "uchar" SIZES "encoding: gzip\n\n", packed, n_packed - 12));
    check_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "ends or is damaged in slice 2");
    scratch_write(path, file,
                  join(file, HEAD "uchar\ndimension: 3\nsizes: 999 999 999\nencoding: gzip\n\n", packed, n_packed));
    check_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "too short");
    static const char head[] = HEAD
        "uchar" SIZES "encoding: gzip\n\n"; /* a row too much shows when the last slice is read, one byte is padding */
    for (size_t more = 0; more <= 2; more++) {
        n_packed = gzip(data + 2, 4 + more, packed, sizeof packed);
        scratch_write(path, file, join(file, head, packed, n_packed));
        if (more < 2)
            check_values(&path, 1, NULL, n, (const double[3]){0}, want);
        else
            check_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES,
                          "'z.nrrd' goes on behind the 2 x 1 x 2 uint8 voxels of its header");
    }
    n_packed = gzip(data + 2, 4, packed,
                    sizeof packed); /* a second member is part of the data, zeros behind the first are none */
    scratch_write(path, file,
                  join(file, head, packed, n_packed + gzip(data, 2, packed + n_packed, sizeof packed - n_packed)));
    check_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "goes on behind");
    memset(packed + n_packed, 0, 100);
    scratch_write(path, file, join(file, head, packed, n_packed + 100));
    check_values(&path, 1, NULL, n, (const double[3]){0}, want);
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
        check_values(path, 1 + i % 2, NULL, n, mm, want);
    }
    scratch_write(path[0], HEAD "uchar" SIZES "encoding: raw\ndata file: gone.raw\n",
                  strlen(HEAD "uchar" SIZES "encoding: raw\ndata file: gone.raw\n"));
    check_refused(path[0], NULL, STATUS_NOT_FOUND, OPTION_SCAN_FILES, "'gone.raw' is missing");
}

static void test_nrrd_refused(void **state)
{
    refuse_header(state, HEAD "uchar" SIZES "encoding: raw\n", "no empty line");
    refuse_header(state, HEAD "block" SIZES "encoding: raw\n\n", "unsupported type 'block'");
    refuse_header(state, HEAD "uchar\ndimension: 4\nsizes: 1 2 1 2\nencoding: raw\n\n", "dimension must be 3");
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
    scratch_write(path, file, join(file, HEAD "uchar" SIZES "encoding: bzip2\n\n", data, 4));
    check_refused(path, NULL, STATUS_UNSUPPORTED, OPTION_SCAN_FILES, "'bzip2'");
}

static void test_raw(void **state)
{
    static const uint8_t data[10] = {'h', 'd', 0, 1, 1, 0, 255, 255, 1, 2};
    static const float want[4] = {1, 256, 65535, 258};
    static const double none[3] = {0, 0, 0};
    struct volume_raw_declaration raw = {.n = {2, 1, 2}, .type = "uint16", .big_endian = true, .header_bytes = 2};
    const char *path = scratch_path(state, "s.raw");
    scratch_write(path, data, sizeof data);
    check_values(&path, 1, &raw, raw.n, none, want);
    check_refused(path, NULL, STATUS_UNSUPPORTED, OPTION_SCAN_FILES, OPTION_RAW);
    raw.header_bytes = 3;
    check_refused(path, &raw, STATUS_FORMAT, OPTION_SCAN_FILES, "too short");
    raw.header_bytes = 2;
    snprintf(raw.type, sizeof raw.type, "uint8");
    check_refused(path, &raw, STATUS_FORMAT, OPTION_SCAN_FILES, "which fits uint16, int16");
    snprintf(raw.type, sizeof raw.type, "bits");
    check_refused(path, &raw, STATUS_INVALID, OPTION_RAW_TYPE, "'bits'");
    raw.header_bytes = (size_t)1 << 62;
    snprintf(raw.type, sizeof raw.type, "uint8");
    check_refused(path, &raw, STATUS_FORMAT, OPTION_SCAN_FILES, "too short");
    raw.header_bytes = SIZE_MAX; /* as an offset it would mean 'at the end of the file' */
    check_refused(path, &raw, STATUS_INVALID, OPTION_RAW_HEADER, "makes no sense");
    raw.header_bytes = 2;
    raw.n[1] = 0;
    check_refused(path, &raw, STATUS_INVALID, OPTION_RAW_SHAPE, "2 x 0 x 2");
    raw.n[1] = (1u << 20) + 1;
    check_refused(path, &raw, STATUS_INVALID, OPTION_RAW_SHAPE, "2 x 1048577 x 2");
}

/* Every reader of the registry has an id of its own with a version, takes its own kind of file only, and refuses that cut short. */
static void test_registry(void **state)
{
    static const char begin[][16] = {"II*", "NDims = 3\n", "NRRD0004\n", "VOL\3",
                                     "hello, there"}; /* one for each reader, and none */
    assert_int_equal(volume_reader_count(), sizeof begin / sizeof begin[0] - 1);
    for (size_t i = 0; i < volume_reader_count(); i++) {
        const volume_reader *r = volume_reader_at(i);
        const char *version = strrchr(r->id, '.'), *path = scratch_path(state, "cut.short");
        assert_true(version != NULL && version[1] == 'v' && version[2] >= '1' && version[2] <= '9');
        for (size_t k = 0; k < i; k++) assert_string_not_equal(r->id, volume_reader_at(k)->id);
        for (size_t k = 0; k < sizeof begin / sizeof begin[0]; k++)
            if (r->recognise((const uint8_t *)begin[k], "scan") != (k == i)) fail_msg("%s and '%s'", r->id, begin[k]);
        scratch_write(path, begin[i], 4);
        void *handle = NULL;
        struct volume_source_info info;
        struct error err = {0};
        assert_int_equal(r->open(&path, 1, &handle, &info, &err), STATUS_FORMAT);
        if (strstr(err.text, "'cut.short'") == NULL || strcmp(err.field, OPTION_SCAN_FILES) != 0)
            fail_msg("%s: %s", r->id, err.text);
        assert_null(handle);
    }
}

/* A picture is noise when its bytes are swapped; noise and coarse values (multiples of 256) are no reason to refuse. */
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
    check_refused(path, &raw, STATUS_FORMAT, OPTION_SCAN_FILES, "endianness is stated wrongly");
    for (int i = 0; i < 5; i++) { /* the right order; noise and coarse values in both */
        raw.big_endian = i % 2 == 0;
        if (i > 0) scratch_write(path, i < 3 ? noise : coarse, sizeof noise);
        assert_int_equal(volume_source_open_declared(&path, 1, &raw, &source, NULL), STATUS_OK);
        volume_source_close(source);
    }
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
    scratch_write(path, file, join(file, header, data, sizeof data));
    check_values(&path, 1, NULL, n, mm, want);
    scratch_write(path, file, join(file, header, data, sizeof data - 1));
    check_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "too short");
    snprintf(header, sizeof header, "%sCompressedData = True\nElementDataFile = LOCAL\n", head);
    scratch_write(path, file, join(file, header, packed, gzip(data, sizeof data, packed, sizeof packed)));
    check_values(&path, 1, NULL, n, mm, want);
    const uint8_t longer[12] = {1, 0, 0, 1, 255, 255, 2, 1};
    scratch_write(path, file, join(file, header, packed, gzip(longer, sizeof longer, packed, sizeof packed)));
    check_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "goes on behind");
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
            scratch_write(path, file, join(file, header, data, sizeof data));
            check_values(&path, 1, NULL, n, (const double[3]){unit[i].mm, unit[i].mm, unit[i].mm}, want);
        }
    snprintf(header, sizeof header,
             "NDims = 3\nDimSize = 2 1 2\nDistanceUnits = inch\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n");
    scratch_write(path, file, join(file, header, data, sizeof data));
    check_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "DistanceUnits must be um, mm or cm, not 'inch'");
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
    check_values(&path, 1, NULL, n, mm, want);
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
    check_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "need 56 bytes, the file has 55");
    memset(longer, 0, sizeof longer);
    memcpy(longer, golden, sizeof golden);
    scratch_write(path, longer, sizeof golden + 7);
    check_values(&path, 1, NULL, n, mm, want);
    scratch_write(path, longer, sizeof golden + 8); /* a row more */
    check_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "need 56 bytes, the file has 64");
    memcpy(bad, golden, sizeof bad);
    bad[11] = 0x7f;
    scratch_write(path, bad, sizeof bad);
    check_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "impossible size");
    scratch_write(path, quantised, sizeof quantised);
    check_refused(path, NULL, STATUS_FORMAT, OPTION_SCAN_FILES, "directions, not densities");
    struct vol_header h;
    float *d;
    assert_int_equal(vol_read_direction(path, &h, &d, NULL), STATUS_OK);
    assert_true(d[0] == 0.0f && d[1] == 0.0f && d[2] == 0.0f && fabsf(d[3] - 1.0f) < 1e-4f && fabsf(d[4]) < 1e-6f);
    free(d);
}

/* A declaration goes through to the step that reads for the job; a voxel that is not a number is named there. */
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
    const struct CMUnitTest test[] = {
        cmocka_unit_test(test_nrrd_types_and_orders),
        cmocka_unit_test(test_nrrd_gzip_and_skips),
        cmocka_unit_test(test_nrrd_detached),
        cmocka_unit_test(test_nrrd_refused),
        cmocka_unit_test(test_raw),
        cmocka_unit_test(test_wrong_byte_order),
        cmocka_unit_test(test_metaimage),
        cmocka_unit_test(test_metaimage_units),
        cmocka_unit_test(test_vol),
        cmocka_unit_test(test_raw_in_a_job),
        cmocka_unit_test(test_registry),
    };
    return cmocka_run_group_tests(test, scratch_folder_setup, scratch_folder_teardown);
}
