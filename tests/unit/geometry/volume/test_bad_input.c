/* Faulty scans through the whole reconstruction: each gives a clear error or a clear warning. */
#include "base/option_id.h"
#include "base/rng.h"
#include "geometry/reconstruct/reconstruct.h"
#include "tests/support/scan/scan_files.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <tiffio.h>

#include <cmocka.h>

enum { N = 48, N_VOXEL = N * N * N };

struct chain {
    struct volume v;
    struct direction_volume d;
    struct fiber_set f;
    struct reconstruct_option o;
    struct reconstruct_report r;
    struct error err;
    char warning[8][400];
    size_t n_warning;
};

static char folder[64], path_text[16][160];

static const char *path_of(const char *name)
{
    static size_t next;
    char *p = path_text[next++ % 16];
    snprintf(p, sizeof path_text[0], "%s/%s", folder, name);
    return p;
}

static void keep(void *context, const char *option, const char *text)
{
    struct chain *c = context;
    if (c->n_warning < 8)
        snprintf(c->warning[c->n_warning++], sizeof c->warning[0], "%s%s%s", option, option[0] ? ": " : "", text);
}

static void chain_init(struct chain *c)
{
    memset(c, 0, sizeof *c);
    reconstruct_option_default(&c->o);
    for (int a = 0; a < 3; a++) c->o.voxel_size_m[a] = 2e-6;
    fiber_set_init(&c->f);
}

static void chain_release(struct chain *c)
{
    volume_release(&c->v);
    direction_volume_release(&c->d);
    fiber_set_release(&c->f);
}

static status chain_read(struct chain *c, const char *const *path, size_t n_path)
{
    status s = reconstruct_read(path, n_path, &c->o, NULL, NULL, NULL, &c->v, &c->r, &c->err);
    if (s == STATUS_OK) reconstruct_warn_volume(&c->o, &c->r, &(struct warning_sink){keep, c});
    return s;
}

static status chain_run(struct chain *c, const char *const *path, size_t n_path)
{
    status s = chain_read(c, path, n_path);
    if (s == STATUS_OK) s = reconstruct_orientation(&c->v, &c->o, NULL, NULL, &c->d, &c->r, &c->err);
    if (s == STATUS_OK) s = reconstruct_fibers(&c->v, &c->d, &c->o, NULL, NULL, &c->f, &c->r, &c->err);
    if (s == STATUS_OK) s = reconstruct_transfer(&c->f, &c->d, NULL, NULL, &c->r, &c->err);
    if (s == STATUS_OK) reconstruct_warn_fibers(&c->r, &c->f, &(struct warning_sink){keep, c});
    return s;
}

static void print_outcome(const struct chain *c, status s)
{
    if (s != STATUS_OK) print_message("  error %d at '%s': %s\n", (int)s, c->err.field, c->err.text);
    for (size_t i = 0; i < c->n_warning; i++) print_message("  warning: %s\n", c->warning[i]);
}

static void assert_warned(const struct chain *c, const char *part)
{
    for (size_t i = 0; i < c->n_warning; i++)
        if (strstr(c->warning[i], part) != NULL) return;
    fail_msg("no warning with '%s'", part);
}

/* Asserts the status, the field, and that the text contains `part`. */
static void assert_refused(const struct chain *c, status got, status want, const char *field, const char *part)
{
    print_outcome(c, got);
    assert_int_equal(got, want);
    assert_string_equal(c->err.field, field);
    if (strstr(c->err.text, part) == NULL) fail_msg("'%s' is not in '%s'", part, c->err.text);
}

/* Fibers of diameter 7 along x, noise 0.15; n_fiber of them, 0: noise only. */
static void fill(struct volume *v, size_t n_fiber)
{
    struct test_cylinder c[9];
    for (size_t i = 0; i < n_fiber; i++)
        c[i] = (struct test_cylinder){.point = {0.0, 8.0 + 16.0 * (double)(i % 3), 8.0 + 16.0 * (double)(i / 3)},
                                      .direction = {1.0, 0.05, 0.0},
                                      .radius = 3.5};
    assert_int_equal(volume_init(v, (const size_t[3]){N, N, N}, (const double[3]){2e-6, 2e-6, 2e-6}, NULL), STATUS_OK);
    test_fill_cylinders(v, c, n_fiber, 0.15, 3);
}

static void write_tiff16(const char *path, size_t n_fiber, size_t n_slice)
{
    uint16_t *pixel = malloc(N_VOXEL * sizeof *pixel);
    struct test_page page[N];
    struct volume v;
    fill(&v, n_fiber);
    for (size_t i = 0; i < N_VOXEL; i++) pixel[i] = (uint16_t)lrintf(20000.0f + 10000.0f * v.density[i]);
    for (size_t k = 0; k < n_slice; k++) page[k] = (struct test_page){N, N, 16, pixel + k * N * N};
    test_write_tiff(path, page, n_slice, COMPRESSION_NONE, TEST_STRIPS);
    volume_release(&v);
    free(pixel);
}

/* MetaImage with the samples beside it; spacing_mm in the header, bytes of the data cut to n_byte. */
static void write_metaimage(const char *name, const char *type, double spacing_mm, const void *data, size_t n_byte)
{
    char text[400], raw[80];
    snprintf(raw, sizeof raw, "%s.raw", name);
    int n = snprintf(text, sizeof text,
                     "ObjectType = Image\nNDims = 3\nDimSize = %d %d %d\nElementType = %s\nElementSpacing = %g %g "
                     "%g\nElementByteOrderMSB = False\n"
                     "ElementDataFile = %s\n",
                     N, N, N, type, spacing_mm, spacing_mm, spacing_mm, raw);
    test_write_bytes(path_of(raw), data, n_byte);
    snprintf(raw, sizeof raw, "%s.mhd", name);
    test_write_bytes(path_of(raw), text, (size_t)n);
}

static uint16_t *make_samples(void)
{
    uint16_t *out = malloc(N_VOXEL * sizeof *out);
    struct volume v;
    fill(&v, 9);
    for (size_t i = 0; i < N_VOXEL; i++) out[i] = (uint16_t)lrintf(20000.0f + 10000.0f * v.density[i]);
    volume_release(&v);
    return out;
}

static void test_wrong_spacing(void **state)
{
    (void)state;
    struct chain c;
    uint16_t *samples = make_samples();
    write_metaimage("spacing", "MET_USHORT", 0.004, samples, N_VOXEL * 2);
    const char *path[] = {path_of("spacing.mhd"), path_of("spacing.raw")};
    chain_init(&c); /* the job says 2 um, the file 4 */
    assert_refused(&c, chain_read(&c, path, 2), STATUS_INVALID, OPTION_VOXEL_SIZE,
                   "the job says 2 um along x, the file says 4 um");
    chain_release(&c);
    write_metaimage("spacing", "MET_USHORT", 0.000002, samples, N_VOXEL * 2);
    chain_init(&c); /* a spacing in a wrong unit: fibers of 0.007 um */
    for (int a = 0; a < 3; a++) c.o.voxel_size_m[a] = NAN;
    assert_refused(&c, chain_read(&c, path, 2), STATUS_INVALID, OPTION_VOXEL_SIZE, "shows no textile fiber");
    chain_release(&c);
    write_metaimage("spacing", "MET_USHORT", 0.02, samples, N_VOXEL * 2);
    chain_init(&c);
    for (int a = 0; a < 3; a++) c.o.voxel_size_m[a] = NAN;
    assert_refused(&c, chain_read(&c, path, 2), STATUS_INVALID, OPTION_VOXEL_SIZE, "a voxel of 20 um shows no");
    c.o.fiber_diameter_voxel = 7.0; /* the answer */
    assert_int_equal(chain_read(&c, path, 2), STATUS_OK);
    chain_release(&c);
    write_metaimage("spacing", "MET_USHORT", 50.0, samples, N_VOXEL * 2);
    chain_init(&c);
    for (int a = 0; a < 3; a++) c.o.voxel_size_m[a] = NAN;
    c.o.fiber_diameter_voxel = 7.0;
    assert_refused(&c, chain_read(&c, path, 2), STATUS_INVALID, OPTION_VOXEL_SIZE, "is not possible");
    chain_release(&c);
    chain_init(&c);
    c.o.raw = (struct volume_raw_declaration){.n = {48, 48, 48}, .type = "uint16"};
    c.o.voxel_size_m[2] = 100e-6;
    assert_refused(&c, chain_read(&c, path + 1, 1), STATUS_INVALID, OPTION_VOXEL_SIZE, "too far from cubes");
    chain_release(&c);
    chain_release(&c);
    free(samples);
}

static void test_wrong_order_and_depth(void **state)
{
    (void)state;
    struct chain c;
    uint16_t *samples = make_samples();
    const char *path = path_of("samples.raw");
    test_write_bytes(path, samples, N_VOXEL * 2);
    chain_init(&c);
    c.o.raw = (struct volume_raw_declaration){.n = {N, N, N}, .type = "uint16", .big_endian = true};
    assert_refused(&c, chain_run(&c, &path, 1), STATUS_FORMAT, OPTION_SCAN_FILES, "stated byte order is wrong");
    chain_release(&c);
    chain_init(&c); /* 16-bit samples taken for 8-bit ones: twice as many bytes as declared */
    c.o.raw = (struct volume_raw_declaration){.n = {N, N, N}, .type = "uint8"};
    assert_refused(&c, chain_run(&c, &path, 1), STATUS_FORMAT, OPTION_SCAN_FILES, "which fits uint16, int16");
    chain_release(&c);
    chain_init(&c); /* the same with a shape of matching size, so that every other sample is noise */
    c.o.raw = (struct volume_raw_declaration){.n = {2 * N, N, N}, .type = "uint8"};
    status s = chain_run(&c, &path, 1);
    print_outcome(&c, s);
    if (s == STATUS_OK) assert_true(c.n_warning > 0);
    chain_release(&c);
    chain_init(&c);
    c.o.raw = (struct volume_raw_declaration){.n = {N, N, N}, .type = "float32"};
    assert_refused(&c, chain_run(&c, &path, 1), STATUS_FORMAT, OPTION_SCAN_FILES, "too short");
    chain_release(&c);
    free(samples);
}

static void test_noise_only(void **state)
{
    (void)state;
    struct chain c;
    const char *path = path_of("noise.tif");
    write_tiff16(path, 0, N / 2);
    chain_init(&c);
    c.o.align = c.o.crop = true;
    assert_refused(&c, chain_run(&c, &path, 1), STATUS_INVALID, OPTION_SCAN_FILES, "nothing but noise");
    chain_release(&c);
}

static void test_one_fiber(void **state)
{
    (void)state;
    struct chain c;
    const char *path = path_of("one.tif");
    write_tiff16(path, 1, N);
    chain_init(&c);
    status s = chain_run(&c, &path, 1);
    print_outcome(&c, s);
    assert_int_equal(s, STATUS_OK);
    assert_int_equal(c.f.n_fiber, 1);
    assert_true(fabs((double)c.f.radius_m[0] / 7e-6 - 1.0) < 0.1);
    assert_warned(&c, "only 1 fiber");
    chain_release(&c);
}

static void test_not_finite(void **state)
{
    (void)state;
    struct chain c;
    struct volume v;
    struct test_page page[N];
    const char *path = path_of("nan.tif");
    fill(&v, 9);
    for (int kind = 0; kind < 2; kind++) {
        v.density[volume_index(v.n, 5, 6, 7)] = kind == 0 ? NAN : INFINITY;
        for (size_t k = 0; k < N; k++) page[k] = (struct test_page){N, N, 32, v.density + k * N * N};
        test_write_tiff(path, page, N, COMPRESSION_NONE, TEST_STRIPS);
        for (int option = 0; option < 2; option++) { /* with alignment the values are looked at earlier */
            chain_init(&c);
            c.o.align = c.o.crop = option == 1;
            assert_refused(&c, chain_run(&c, &path, 1), STATUS_INVALID, OPTION_SCAN_FILES,
                           kind == 0 ? "voxel (5, 6, 7) is NaN" : "voxel (5, 6, 7) is infinite");
            chain_release(&c);
        }
    }
    volume_release(&v);
}

static void test_lying_header(void **state)
{
    (void)state;
    struct chain c;
    uint16_t *samples = make_samples();
    write_metaimage("short", "MET_USHORT", 0.002, samples, N_VOXEL);
    const char *path[] = {path_of("short.mhd"), path_of("short.raw")};
    chain_init(&c);
    assert_refused(&c, chain_run(&c, path, 2), STATUS_FORMAT, OPTION_SCAN_FILES, "too short");
    chain_release(&c);
    write_metaimage("short", "MET_UCHAR", 0.002, samples, N_VOXEL * 2);
    chain_init(&c);
    assert_refused(&c, chain_run(&c, path, 2), STATUS_FORMAT, OPTION_SCAN_FILES, "which fits uint16, int16");
    chain_release(&c);
    static const char deep[] = "ObjectType = Image\nNDims = 3\nDimSize = 48 48 900000\nElementType = "
                               "MET_USHORT\nElementDataFile = short.raw\n";
    test_write_bytes(path[0], deep, sizeof deep - 1);
    chain_init(&c);
    assert_refused(&c, chain_run(&c, path, 2), STATUS_FORMAT, OPTION_SCAN_FILES, "too short");
    chain_release(&c);
    static const char huge[] = "ObjectType = Image\nNDims = 3\nDimSize = 900000 900000 900000\nElementType = "
                               "MET_USHORT\nElementDataFile = short.raw\n";
    test_write_bytes(path[0], huge, sizeof huge - 1);
    chain_init(&c);
    assert_refused(&c, chain_run(&c, path, 2), STATUS_TOO_LARGE, OPTION_SCAN_FILES, "short.mhd");
    chain_release(&c);
    free(samples);
}

static void test_empty_slice(void **state)
{
    (void)state;
    struct chain c;
    uint16_t *samples = make_samples();
    const char *path[3];
    for (size_t k = 0; k < 3; k++) {
        char name[32];
        snprintf(name, sizeof name, "slice-%zu.tif", k);
        path[k] = path_of(name);
        const struct test_page page = {N, N, 16, samples + k * N * N};
        test_write_tiff(path[k], &page, 1, COMPRESSION_NONE, TEST_STRIPS);
    }
    for (size_t k = 0; k < 3; k++) {
        char name[32];
        snprintf(name, sizeof name, "'slice-%zu.tif': the file is empty", k);
        test_write_bytes(path[k], "", 0);
        chain_init(&c);
        assert_refused(&c, chain_run(&c, path, 3), STATUS_FORMAT, OPTION_SCAN_FILES, name);
        chain_release(&c);
        const struct test_page page = {N, N, 16, samples + k * N * N};
        test_write_tiff(path[k], &page, 1, COMPRESSION_NONE, TEST_STRIPS);
    }
    free(samples);
}

/* A good scan gives no warning. */
static void test_good_scan_gives_no_warning(void **state)
{
    (void)state;
    struct chain c;
    const char *path = path_of("good.tif");
    write_tiff16(path, 9, N);
    chain_init(&c);
    status s = chain_run(&c, &path, 1);
    print_outcome(&c, s);
    assert_int_equal(s, STATUS_OK);
    assert_int_equal(c.f.n_fiber, 9);
    assert_int_equal(c.n_warning, 0);
    chain_release(&c);
}

static int make_folder(void **state)
{
    (void)state;
    test_make_folder(folder);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_wrong_spacing), cmocka_unit_test(test_wrong_order_and_depth),
        cmocka_unit_test(test_noise_only),    cmocka_unit_test(test_one_fiber),
        cmocka_unit_test(test_not_finite),    cmocka_unit_test(test_lying_header),
        cmocka_unit_test(test_empty_slice),   cmocka_unit_test(test_good_scan_gives_no_warning),
    };
    return cmocka_run_group_tests(tests, make_folder, NULL);
}
