/* Curves and primaries that picture files declare, against Little CMS's own conversion, and contradictions. */
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/photographs/reader/photograph.h"
#include "tests/support/scratch_folder.h"
#include "tests/support/stated_files.h"

#include <lcms2.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { EDGE = 24, ROOM = 1 << 16, N_SAMPLE = EDGE * EDGE * 3 };

static uint16_t sample[N_SAMPLE];

/* Colors of all kinds below full scale. */
static void fill(unsigned largest)
{
    for (size_t i = 0; i < N_SAMPLE; i++) sample[i] = (uint16_t)((uint32_t)(i * 2654435761u) % (largest - 1));
}

static void read_ok(const char *path, enum job_transfer transfer, struct image *im, struct photograph_record *r)
{
    struct error err = {0};
    const struct job_photograph p = photograph_plain(transfer);
    if (photograph_read(path, &p, im, r, &err) != STATUS_OK) fail_msg("%s", err.text);
}

static void check_refused(const char *path, enum job_transfer transfer, const char *first, const char *second)
{
    struct image im;
    struct error err = {0};
    const struct job_photograph p = photograph_plain(transfer);
    assert_int_not_equal(photograph_read(path, &p, &im, NULL, &err), STATUS_OK);
    if (strstr(err.text, first) == NULL || strstr(err.text, second) == NULL || strstr(err.text, "colors.") == NULL)
        fail_msg("'%s' and '%s' are not in '%s'", first, second, err.text);
}

/* Profiles as cameras and programs embed them. Columns: primaries, white, gamma (0: the curve of sRGB). */
static const struct {
    const char *name;
    double xy[4][2], gamma;
    bool like_srgb; /* its curve may be declared as srgb */
} profile[] = {
    {"sRGB", {{0.64, 0.33}, {0.30, 0.60}, {0.15, 0.06}, {0.3127, 0.3290}}, 0.0, true},
    {"Display P3", {{0.68, 0.32}, {0.265, 0.69}, {0.15, 0.06}, {0.3127, 0.3290}}, 0.0, true},
    {"Adobe RGB", {{0.64, 0.33}, {0.21, 0.71}, {0.15, 0.06}, {0.3127, 0.3290}}, 2.19921875, true},
    {"ProPhoto", {{0.7347, 0.2653}, {0.1596, 0.8404}, {0.0366, 0.0001}, {0.3457, 0.3585}}, 1.8, false},
    {"linear 2020", {{0.708, 0.292}, {0.170, 0.797}, {0.131, 0.046}, {0.3127, 0.3290}}, 1.0, false},
};

/* Makes a profile. Returns its size. */
static unsigned make_profile(size_t k, uint8_t bytes[ROOM])
{
    static const double srgb[5] = {2.4, 1.0 / 1.055, 0.055 / 1.055, 1.0 / 12.92, 0.04045};
    const cmsCIExyY white = {profile[k].xy[3][0], profile[k].xy[3][1], 1.0};
    const cmsCIExyYTRIPLE color = {{profile[k].xy[0][0], profile[k].xy[0][1], 1.0},
                                   {profile[k].xy[1][0], profile[k].xy[1][1], 1.0},
                                   {profile[k].xy[2][0], profile[k].xy[2][1], 1.0}};
    cmsToneCurve *curve =
        profile[k].gamma > 0.0 ? cmsBuildGamma(NULL, profile[k].gamma) : cmsBuildParametricToneCurve(NULL, 4, srgb);
    cmsHPROFILE made = cmsCreateRGBProfile(&white, &color, (cmsToneCurve *[3]){curve, curve, curve});
    cmsMLU *text = cmsMLUalloc(NULL, 1);
    cmsMLUsetASCII(text, "en", "US", profile[k].name);
    cmsWriteTag(made, cmsSigProfileDescriptionTag, text);
    cmsUInt32Number n = 0;
    assert_true(cmsSaveProfileToMem(made, NULL, &n) && n < ROOM && cmsSaveProfileToMem(made, bytes, &n));
    cmsMLUfree(text);
    cmsFreeToneCurve(curve);
    cmsCloseProfile(made);
    return n;
}

/* The colors as Little CMS converts them to linear rgb of Rec. 709. */
static void convert(const void *bytes, unsigned n, double largest, float *out)
{
    const cmsCIExyY white = {0.3127, 0.3290, 1.0};
    const cmsCIExyYTRIPLE color = {{0.64, 0.33, 1.0}, {0.30, 0.60, 1.0}, {0.15, 0.06, 1.0}};
    float *in = malloc(N_SAMPLE * sizeof *in);
    for (size_t i = 0; i < N_SAMPLE; i++) in[i] = (float)(sample[i] / largest);
    cmsToneCurve *linear = cmsBuildGamma(NULL, 1.0);
    cmsHPROFILE from = cmsOpenProfileFromMem(bytes, n),
                to = cmsCreateRGBProfile(&white, &color, (cmsToneCurve *[3]){linear, linear, linear});
    cmsHTRANSFORM t = cmsCreateTransform(from, TYPE_RGB_FLT, to, TYPE_RGB_FLT, INTENT_RELATIVE_COLORIMETRIC, 0);
    cmsDoTransform(t, in, out, N_SAMPLE / 3);
    cmsDeleteTransform(t);
    cmsCloseProfile(from);
    cmsCloseProfile(to);
    cmsFreeToneCurve(linear);
    free(in);
}

static void check_colors(const char *path, enum job_transfer transfer, const float *want, double allowed)
{
    struct image im;
    struct photograph_record r;
    read_ok(path, transfer, &im, &r);
    assert_true(r.info.curve_of_file);
    for (size_t i = 0; i < N_SAMPLE; i++)
        if (!(fabs((double)im.pixel[i] - (double)want[i]) <= allowed))
            fail_msg("%s: sample %zu is %g, not %g", path, i, (double)im.pixel[i], (double)want[i]);
    image_release(&im);
    const struct file_statement *f = file_ledger_find(&r.info.ledger, "color profile");
    assert_true(f != NULL && f->use == FILE_STATEMENT_APPLIED);
}

/* A chunk iCCP: name, method, compressed profile. */
static size_t pack_profile(const uint8_t *bytes, unsigned n, uint8_t *out)
{
    static const uint8_t stored[] = {'p', 0, 0, 0x78, 0x01};
    memcpy(out, stored, sizeof stored); /* zlib with stored blocks of at most 65,535 bytes */
    uint8_t *p = out + sizeof stored;
    uint32_t a = 1, b = 0;
    *p++ = 1;
    *p++ = (uint8_t)n, *p++ = (uint8_t)(n >> 8), *p++ = (uint8_t)~n, *p++ = (uint8_t)(~n >> 8);
    memcpy(p, bytes, n);
    for (unsigned i = 0; i < n; i++) a = (a + bytes[i]) % 65521, b = (b + a) % 65521;
    p += n;
    *p++ = (uint8_t)(b >> 8), *p++ = (uint8_t)b, *p++ = (uint8_t)(a >> 8), *p++ = (uint8_t)a;
    return (size_t)(p - out);
}

static void test_profiles(void **state)
{
    static uint8_t bytes[ROOM], chunk[ROOM + 64], file[2 * ROOM + 8 * N_SAMPLE];
    static float want[N_SAMPLE];
    const uint16_t bits[3] = {16, 16, 16};
    const char *png = scratch_path(state, "colors.png"), *tiff = scratch_path(state, "colors.tif");
    for (size_t k = 0; k < sizeof profile / sizeof *profile; k++) {
        const unsigned n = make_profile(k, bytes);
        fill(65535);
        convert(bytes, n, 65535.0, want);
        stated_write_png(png, EDGE, EDGE, 16, 3, sample,
                         &(struct file_part){"iCCP", 0, chunk, pack_profile(bytes, n, chunk)}, 1);
        check_colors(png, JOB_TRANSFER_UNDECLARED, want, 1e-4);
        const struct folder_entry entry[] = {{256, 3, EDGE},
                                             {257, 3, EDGE},
                                             {258, 3, 0, false, 3, bits},
                                             {259, 3, 1},
                                             {262, 3, 2},
                                             {273, 4, 0},
                                             {277, 3, 3},
                                             {278, 3, EDGE},
                                             {279, 4, sizeof sample},
                                             {34675, 7, 0, false, n, NULL, bytes}};
        const size_t n_file =
            folder_build(false, entry, sizeof entry / sizeof *entry, sample, sizeof sample, file, sizeof file);
        scratch_write(tiff, (char *)file, n_file);
        check_colors(tiff, JOB_TRANSFER_UNDECLARED, want, 1e-4);
        if (profile[k].like_srgb)
            check_colors(tiff, JOB_TRANSFER_SRGB, want, 1e-4);
        else
            check_refused(tiff, JOB_TRANSFER_SRGB, profile[k].name, "\"transfer\": \"srgb\"");
        if (profile[k].gamma == 1.0)
            check_colors(tiff, JOB_TRANSFER_LINEAR, want, 1e-4);
        else
            check_refused(tiff, JOB_TRANSFER_LINEAR, profile[k].name, "\"transfer\": \"linear\"");
    }
}

/* A JPEG of one color, whose profile lies in a marker. */
static void test_profile_of_jpeg(void **state)
{
    static uint8_t bytes[ROOM], marker[ROOM + 14] = "ICC_PROFILE\0\1\1", rgb[N_SAMPLE];
    static float want[N_SAMPLE];
    const char *path = scratch_path(state, "colors.jpg");
    const unsigned n = make_profile(2, bytes);
    for (size_t i = 0; i < N_SAMPLE; i++) sample[i] = rgb[i] = (uint8_t)(150 - 40 * (i % 3));
    memcpy(marker + 14, bytes, n);
    convert(bytes, n, 255.0, want);
    const struct file_part part = {NULL, 0xe2, marker, n + 14};
    stated_write_jpeg(path, EDGE, EDGE, rgb, &part, 1);
    check_colors(path, JOB_TRANSFER_UNDECLARED, want, 0.01); /* JPEG rounds its luminance and chroma */
    check_refused(path, JOB_TRANSFER_LINEAR, "Adobe RGB", "linear");
}

/* A profile of tables alone, a damaged one, and one of another color space. */
static void test_other_profiles(void **state)
{
    static uint8_t bytes[ROOM], file[2 * ROOM + 8 * N_SAMPLE];
    const uint16_t bits[3] = {16, 16, 16};
    const char *path = scratch_path(state, "colors.tif");
    fill(65535);
    for (int kind = 0; kind < 3; kind++) {
        unsigned n = make_profile(1, bytes);
        cmsHPROFILE p = kind == 0 ? cmsCreateLab4Profile(NULL) : cmsOpenProfileFromMem(bytes, n);
        if (kind == 1) { /* rgb without its matrix */
            uint8_t *tag = bytes + 132;
            for (unsigned i = 0; i < bytes[131]; i++)
                if (memcmp(tag + 12 * i, "rXYZ", 4) == 0) tag[12 * i] = 'q';
        } else if (kind == 0) {
            cmsUInt32Number size = 0;
            assert_true(cmsSaveProfileToMem(p, NULL, &size) && cmsSaveProfileToMem(p, bytes, &size));
            n = size;
        } else {
            n = 100; /* cut within its header */
        }
        cmsCloseProfile(p);
        const struct folder_entry entry[] = {{256, 3, EDGE},
                                             {257, 3, EDGE},
                                             {258, 3, 0, false, 3, bits},
                                             {259, 3, 1},
                                             {262, 3, 2},
                                             {273, 4, 0},
                                             {277, 3, 3},
                                             {278, 3, EDGE},
                                             {279, 4, sizeof sample},
                                             {34675, 7, 0, false, n, NULL, bytes}};
        const size_t n_file =
            folder_build(false, entry, sizeof entry / sizeof *entry, sample, sizeof sample, file, sizeof file);
        scratch_write(path, (char *)file, n_file);
        if (kind == 1) {
            check_refused(path, JOB_TRANSFER_SRGB, "no matrix and curves", "Display P3");
            continue;
        }
        struct image im;
        struct photograph_record r;
        read_ok(path, JOB_TRANSFER_LINEAR, &im, &r);
        image_release(&im);
        const struct file_statement *f = file_ledger_find(&r.info.ledger, "color profile");
        assert_true(f != NULL && f->use == FILE_STATEMENT_NOT_USED && !r.info.curve_of_file);
        check_refused(path, JOB_TRANSFER_UNDECLARED, "does not say", "transfer");
    }
}

/* Reads a PNG of 16 bits with chunks and compares its first channel with a curve. */
static void check_curve(const char *path, const struct file_part *part, size_t n, enum job_transfer transfer,
                        double exponent)
{
    struct image im;
    struct photograph_record r;
    stated_write_png(path, EDGE, EDGE, 16, 1, sample, part, n);
    read_ok(path, transfer, &im, &r);
    for (size_t i = 0; i < EDGE * EDGE; i++) {
        double v = sample[i] / 65535.0, want = exponent > 0.0 ? pow(v, exponent)
                                               : v <= 0.04045 ? v / 12.92
                                                              : pow((v + 0.055) / 1.055, 2.4);
        if (!(fabs((double)im.pixel[3 * i + 1] - want) < 1e-5))
            fail_msg("%g is %g, not %g", v, (double)im.pixel[3 * i + 1], want);
    }
    image_release(&im);
}

static void test_chunks_of_png(void **state)
{
    const char *path = scratch_path(state, "colors.png");
    const struct file_part linear = {"gAMA", 0, "\0\1\x86\xa0", 4}, half = {"gAMA", 0, "\0\0\xb1\x8f", 4},
                           srgb = {"sRGB", 0, "\0", 1}, pq = {"cICP", 0, "\11\20\0\1", 4},
                           hlg = {"cICP", 0, "\11\22\0\1", 4}, plain = {"cICP", 0, "\1\15\0\1", 4},
                           narrow = {"cICP", 0, "\1\15\0\0", 4}, straight = {"cICP", 0, "\1\10\0\1", 4},
                           gamma_18 = {"gAMA", 0, "\0\0\xd9\3", 4};
    fill(65535);
    check_curve(path, &linear, 1, JOB_TRANSFER_UNDECLARED, 1.0);
    check_curve(path, &linear, 1, JOB_TRANSFER_LINEAR, 1.0);
    check_refused(path, JOB_TRANSFER_SRGB, "gAMA chunk says that its values are linear", "\"transfer\": \"srgb\"");
    check_curve(path, &half, 1, JOB_TRANSFER_UNDECLARED, 1.0 / 0.45455);
    check_curve(path, &half, 1, JOB_TRANSFER_SRGB, 0.0); /* gAMA stands for sRGB, too */
    check_refused(path, JOB_TRANSFER_LINEAR, "gAMA chunk says that its values are gamma 2.2", "linear");
    check_curve(path, &gamma_18, 1, JOB_TRANSFER_UNDECLARED, 1.0 / 0.55555);
    check_refused(path, JOB_TRANSFER_SRGB, "gamma 1.8", "srgb");
    check_curve(path, (struct file_part[]){srgb, half}, 2, JOB_TRANSFER_UNDECLARED, 0.0);
    check_refused(path, JOB_TRANSFER_LINEAR, "sRGB chunk", "linear");
    check_curve(path, &plain, 1, JOB_TRANSFER_UNDECLARED, 0.0);
    check_curve(path, (struct file_part[]){straight, srgb, half}, 3, JOB_TRANSFER_UNDECLARED,
                1.0); /* cICP comes first */
    stated_write_png(path, EDGE, EDGE, 16, 3, sample, &pq, 1);
    check_refused(path, JOB_TRANSFER_SRGB, "cICP", "PQ");
    stated_write_png(path, EDGE, EDGE, 16, 3, sample, &hlg, 1);
    check_refused(path, JOB_TRANSFER_UNDECLARED, "cICP", "HLG");
    stated_write_png(path, EDGE, EDGE, 16, 3, sample, &narrow, 1);
    check_refused(path, JOB_TRANSFER_SRGB, "cICP chunk (1 13 0 0)", "not known");
}

/* The color space of Exif: sRGB needs no transfer, and contradicts `linear`. */
static void test_color_space_of_exif(void **state)
{
    static uint8_t folder[ROOM];
    const char *path = scratch_path(state, "colors.png");
    fill(65535);
    for (int k = 1; k <= 3; k++) {
        const struct folder_entry entry = {0xa001, 3, k == 3 ? 65535 : k, true};
        const size_t n = folder_build(k == 1, &entry, 1, NULL, 0, folder, sizeof folder);
        const struct file_part part = {"eXIf", 0, folder, n};
        if (k < 3) check_curve(path, &part, 1, JOB_TRANSFER_UNDECLARED, k == 1 ? 0.0 : 2.19921875);
        stated_write_png(path, EDGE, EDGE, 16, 3, sample, &part, 1);
        if (k < 3)
            check_refused(path, JOB_TRANSFER_LINEAR, "Exif color space", "linear");
        else
            check_refused(path, JOB_TRANSFER_UNDECLARED, "does not say", "transfer");
    }
}

/* Primaries of TIFF and PNG, and a table of TIFF: P3 of a color as in the test of OpenEXR. */
static void test_primaries(void **state)
{
    static uint16_t table[3 * 65536];
    static const uint8_t chrm[32] = {0, 0, 0x7a, 0x26, 0, 0, 0x80, 0x84, 0, 1, 9,    0xa0, 0, 0, 0x7d, 0,
                                     0, 0, 0x67, 0x84, 0, 1, 0xd,  0x88, 0, 0, 0x3a, 0x98, 0, 0, 0x17, 0x70};
    const double want[3] = {0.567482, 0.187383, 0.084281}, color[3] = {0.5, 0.2, 0.1};
    const char *path = scratch_path(state, "colors.png");
    struct image im;
    struct photograph_record r;
    for (size_t i = 0; i < N_SAMPLE; i++) sample[i] = (uint16_t)lrint(65535.0 * color[i % 3]);
    stated_write_png(path, EDGE, EDGE, 16, 3, sample,
                     (struct file_part[]){{"gAMA", 0, "\0\1\x86\xa0", 4}, {"cHRM", 0, chrm, sizeof chrm}}, 2);
    read_ok(path, JOB_TRANSFER_UNDECLARED, &im, &r);
    for (int c = 0; c < 3; c++) assert_true(fabs((double)im.pixel[c] - want[c]) < 1e-4);
    image_release(&im);
    assert_true(file_ledger_find(&r.info.ledger, "cHRM")->use == FILE_STATEMENT_APPLIED);

    const uint16_t bits[3] = {16, 16, 16};
    for (size_t i = 0; i < sizeof table / sizeof *table; i++)
        table[i] = (uint16_t)lrint(65535.0 * pow((double)(i % 65536) / 65535.0, 2.0));
    const struct folder_entry entry[] = {{256, 3, EDGE},
                                         {257, 3, EDGE},
                                         {258, 3, 0, false, 3, bits},
                                         {259, 3, 1},
                                         {262, 3, 2},
                                         {273, 4, 0},
                                         {277, 3, 3},
                                         {278, 3, EDGE},
                                         {279, 4, sizeof sample},
                                         {301, 3, 0, false, 3 * 65536, table}};
    static uint8_t large[ROOM + sizeof table + 8 * N_SAMPLE];
    const size_t n =
        folder_build(false, entry, sizeof entry / sizeof *entry, sample, sizeof sample, large, sizeof large);
    const char *tiff = scratch_path(state, "colors.tif");
    scratch_write(tiff, (char *)large, n);
    read_ok(tiff, JOB_TRANSFER_UNDECLARED, &im, &r);
    for (int c = 0; c < 3; c++) assert_true(fabs((double)im.pixel[c] - color[c] * color[c]) < 1e-4);
    image_release(&im);
    check_refused(tiff, JOB_TRANSFER_LINEAR, "TransferFunction", "linear");
}

/* A pixel with one clipped channel of a wide space is unknown in all channels of Rec. 709. */
static void test_clipped_and_converted(void **state)
{
    static uint8_t bytes[ROOM], chunk[ROOM + 64];
    const char *path = scratch_path(state, "colors.png");
    const unsigned n = make_profile(2, bytes);
    struct image im;
    struct photograph_record r;
    for (size_t i = 0; i < N_SAMPLE; i++) sample[i] = (uint16_t)(i % 3 == 1 ? 65000 : 20000 + i % 97);
    for (size_t i = 0; i < 10; i++) sample[3 * 30 * i + i % 3] = 65535; /* each channel in turn */
    stated_write_png(path, EDGE, EDGE, 16, 3, sample,
                     &(struct file_part){"iCCP", 0, chunk, pack_profile(bytes, n, chunk)}, 1);
    read_ok(path, JOB_TRANSFER_UNDECLARED, &im, &r);
    assert_true(r.saturated_share == 10.0 / (EDGE * EDGE));
    for (size_t i = 0; i < EDGE * EDGE; i++)
        for (int c = 0; c < 3; c++)
            assert_true(((double)im.pixel[3 * i + (size_t)c] >= r.info.saturation[c]) == (i % 30 == 0 && i < 300));
    image_release(&im);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_profiles),
        cmocka_unit_test(test_profile_of_jpeg),
        cmocka_unit_test(test_other_profiles),
        cmocka_unit_test(test_chunks_of_png),
        cmocka_unit_test(test_color_space_of_exif),
        cmocka_unit_test(test_primaries),
        cmocka_unit_test(test_clipped_and_converted),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
