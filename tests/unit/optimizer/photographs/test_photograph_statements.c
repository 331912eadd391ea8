/* Statements of picture files beside their samples, from every carrier: exposure, samples of few bits. */
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/photographs/reader/photograph.h"
#include "tests/support/scratch_folder.h"
#include "tests/support/stated_files.h"

#include <OpenEXR/openexr.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { EDGE = 24, ROOM = 8192 };

static void read_ok(const char *path, enum job_transfer transfer, struct image *im, struct photograph_record *r)
{
    struct error err = {0};
    const struct job_photograph p = photograph_plain(transfer);
    if (photograph_read(path, &p, im, r, &err) != STATUS_OK) fail_msg("%s", err.text);
}

/* Reads a picture and compares what it states; 0: not stated. */
static void check_exposure(const char *path, enum job_transfer transfer, double exposure_s, double f_number, double iso)
{
    struct image im;
    struct photograph_record r;
    read_ok(path, transfer, &im, &r);
    image_release(&im);
    const double want[3] = {exposure_s, f_number, iso}, have[3] = {r.info.exposure_s, r.info.aperture, r.info.iso};
    static const char *const name[3] = {"exposure time", "f-number", "ISO"};
    for (int i = 0; i < 3; i++) {
        const struct file_statement *f = file_ledger_find(&r.info.ledger, name[i]);
        if (want[i] == 0.0) {
            assert_true(isnan(have[i]) && f == NULL);
        } else {
            if (!(fabs(have[i] / want[i] - 1.0) < 1e-3)) fail_msg("%s: %s %g, not %g", path, name[i], have[i], want[i]);
            assert_true(f != NULL && f->use == FILE_STATEMENT_APPLIED);
        }
    }
}

/* An exposure of 0.1 s at f/8, ISO 100, with numbers of every type that can hold them. */
static size_t exposure_folder(unsigned kind, bool big_endian, bool inner, uint8_t *out)
{
    static const uint16_t type[5] = {5, 10, 11, 12, 10};
    struct folder_entry entry[] = {{0x829a, type[kind], 0.1, inner},
                                   {0x829d, type[kind], 8.0, inner},
                                   {0x8827, kind % 2 == 0 ? 3 : 4, 100, inner}};
    if (kind == 4) { /* APEX */
        entry[0] = entry[2];
        entry[1] = (struct folder_entry){0x9201, 10, log2(10.0), inner};
        entry[2] = (struct folder_entry){0x9202, 5, 6.0, inner};
    }
    return folder_build(big_endian, entry, 3, NULL, 0, out, ROOM);
}

static void test_exposure_of_exif(void **state)
{
    static uint8_t folder[ROOM], marked[ROOM + 6] = "Exif\0", rgb[EDGE * EDGE * 3];
    static uint16_t word[EDGE * EDGE * 3];
    const char *jpeg = scratch_path(state, "a.jpg"), *png = scratch_path(state, "a.png");
    for (size_t i = 0; i < EDGE * EDGE * 3; i++) word[i] = rgb[i] = (uint8_t)(100 + i % 7);
    for (unsigned kind = 0; kind < 5; kind++)
        for (int order = 0; order < 4; order++) {
            const size_t n = exposure_folder(kind, order % 2 == 1, order < 2, folder);
            memcpy(marked + 6, folder, n);
            stated_write_jpeg(jpeg, EDGE, EDGE, rgb, &(struct file_part){NULL, 0xe1, marked, n + 6}, 1);
            check_exposure(jpeg, JOB_TRANSFER_SRGB, 0.1, 8.0, 100.0);
            stated_write_png(png, EDGE, EDGE, 8, 3, word, &(struct file_part){"eXIf", 0, folder, n}, 1);
            check_exposure(png, JOB_TRANSFER_SRGB, 0.1, 8.0, 100.0);
            for (size_t cut = 0; cut < n; cut++) { /* a part of the data may be lost; no number may be made up */
                struct image im;
                struct photograph_record r;
                stated_write_png(png, EDGE, EDGE, 8, 3, word, &(struct file_part){"eXIf", 0, folder, cut}, 1);
                read_ok(png, JOB_TRANSFER_SRGB, &im, &r);
                image_release(&im);
                assert_true(isnan(r.info.exposure_s) || fabs(r.info.exposure_s - 0.1) < 1e-4);
            }
        }
}

static void test_exposure_of_tiff(void **state)
{
    static const uint16_t bits[3] = {8, 8, 8};
    static uint8_t rgb[EDGE * EDGE * 3], file[ROOM + sizeof rgb];
    const char *path = scratch_path(state, "a.tif");
    memset(rgb, 120, sizeof rgb);
    for (int kind = 0; kind < 4; kind++) {
        const struct folder_entry entry[] = {
            {256, 3, EDGE},
            {257, 3, EDGE},
            {258, 3, 0, false, 3, bits},
            {259, 3, 1},
            {262, 3, 2},
            {273, 4, 0},
            {277, 3, 3},
            {278, 3, EDGE},
            {279, 4, sizeof rgb},
            {0x8827, 3, kind == 2 ? 65535 : 200, true},
            {0x8832, 4, kind == 2 ? 102400 : 200, true},
            {kind == 3 ? 0x829a : 0x9201, kind == 3 ? 12 : 10, kind == 3 ? 0.25 : 2.0, true},
            {kind == 3 ? 0x829d : 0x9202, kind == 3 ? 12 : 5, kind == 3 ? 8.0 : 6.0, true}};
        size_t n = folder_build(kind % 2 == 1, entry, sizeof entry / sizeof *entry, rgb, sizeof rgb, file, sizeof file);
        scratch_write(path, (char *)file, n);
        check_exposure(path, JOB_TRANSFER_LINEAR, 0.25, 8.0, kind == 2 ? 102400.0 : 200.0);
    }
}

/* Numbers that are no times: the file counts as not stating them. */
static void test_exposures_that_are_none(void **state)
{
    static uint8_t folder[ROOM];
    static uint16_t word[EDGE * EDGE * 3];
    const char *png = scratch_path(state, "none.png");
    for (size_t i = 0; i < EDGE * EDGE * 3; i++) word[i] = (uint16_t)(100 + i % 7);
    static const double value[] = {0.0, -0.1, NAN, INFINITY};
    for (size_t i = 0; i < sizeof value / sizeof *value; i++) {
        const struct folder_entry entry[] = {{0x829a, 12, value[i], true}, {0x829d, 12, value[i], true}};
        size_t n = folder_build(false, entry, 2, NULL, 0, folder, sizeof folder);
        stated_write_png(png, EDGE, EDGE, 8, 3, word, &(struct file_part){"eXIf", 0, folder, n}, 1);
        check_exposure(png, JOB_TRANSFER_SRGB, 0, 0, 0);
    }
}

/* Writes a picture of one color with the attributes of a camera. */
static void write_exr(const char *path, const float rgb[3], double exposure_s, const exr_attr_chromaticities_t *colors)
{
    static const char *const name[3] = {"B", "G", "R"};
    exr_context_t file;
    int part;
    float row[3 * EDGE];
    for (int i = 0; i < 3 * EDGE; i++) row[i] = rgb[2 - i / EDGE];
    assert_int_equal(exr_start_write(&file, path, EXR_WRITE_FILE_DIRECTLY, NULL), EXR_ERR_SUCCESS);
    assert_int_equal(exr_add_part(file, "p", EXR_STORAGE_SCANLINE, &part), EXR_ERR_SUCCESS);
    assert_int_equal(exr_initialize_required_attr_simple(file, part, EDGE, EDGE, EXR_COMPRESSION_NONE),
                     EXR_ERR_SUCCESS);
    for (int c = 0; c < 3; c++)
        assert_int_equal(exr_add_channel(file, part, name[c], EXR_PIXEL_FLOAT, EXR_PERCEPTUALLY_LINEAR, 1, 1),
                         EXR_ERR_SUCCESS);
    if (exposure_s > 0.0) {
        assert_int_equal(exr_attr_set_float(file, part, "expTime", (float)exposure_s), EXR_ERR_SUCCESS);
        assert_int_equal(exr_attr_set_float(file, part, "aperture", 4.0f), EXR_ERR_SUCCESS);
        assert_int_equal(exr_attr_set_float(file, part, "isoSpeed", 800.0f), EXR_ERR_SUCCESS);
        assert_int_equal(exr_attr_set_string(file, part, "lensModel", "50 mm"), EXR_ERR_SUCCESS);
    }
    if (colors != NULL)
        assert_int_equal(exr_attr_set_chromaticities(file, part, "chromaticities", colors), EXR_ERR_SUCCESS);
    assert_int_equal(exr_write_header(file), EXR_ERR_SUCCESS);
    for (int y = 0; y < EDGE; y++)
        assert_int_equal(exr_write_scanline_chunk(file, part, y, row, sizeof row), EXR_ERR_SUCCESS);
    assert_int_equal(exr_finish(&file), EXR_ERR_SUCCESS);
}

static void test_statements_of_exr(void **state)
{
    const char *path = scratch_path(state, "a.exr");
    struct image im;
    struct photograph_record r;
    write_exr(path, (float[3]){0.1f, 0.2f, 0.3f}, 0.125, NULL);
    check_exposure(path, JOB_TRANSFER_UNDECLARED, 0.125, 4.0, 800.0);
    read_ok(path, JOB_TRANSFER_UNDECLARED, &im, &r);
    image_release(&im);
    const struct file_statement *f = file_ledger_find(&r.info.ledger, "further attributes");
    assert_true(f != NULL && strcmp(f->value, "lensModel") == 0 && f->use == FILE_STATEMENT_NOT_USED);
    assert_null(file_ledger_find(&r.info.ledger, "channels")); /* all of them are read */
}

/* Colors of other primaries. Wanted values: NumPy in double precision, by Bradford's matrix and the definition of
 * primaries (Rec. 2020, P3-D65, ACES AP0; white; X, Y, Z as rgb with two white points). */
static void test_primaries_of_exr(void **state)
{
    static const struct {
        exr_attr_chromaticities_t colors;
        float rgb[3];
        double want[3];
    } k[] = {
        {{0.64f, 0.33f, 0.30f, 0.60f, 0.15f, 0.06f, 0.3127f, 0.3290f}, {0.5f, 0.2f, 0.1f}, {0.5, 0.2, 0.1}},
        {{0.708f, 0.292f, 0.170f, 0.797f, 0.131f, 0.046f, 0.3127f, 0.3290f},
         {0.5f, 0.2f, 0.1f},
         {0.705432, 0.163470, 0.082682}},
        {{0.680f, 0.320f, 0.265f, 0.690f, 0.150f, 0.060f, 0.3127f, 0.3290f},
         {0.5f, 0.2f, 0.1f},
         {0.567482, 0.187383, 0.084281}},
        {{0.7347f, 0.2653f, 0.0f, 1.0f, 0.0001f, -0.077f, 0.32168f, 0.33767f},
         {0.5f, 0.2f, 0.1f},
         {0.995261, 0.126680, 0.078551}},
        {{1.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.3127f, 0.3290f}, {0.29223f, 0.20269f, 0.07103f}, {0.6, 0.1, 0.05}},
        {{1.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 1.0f / 3, 1.0f / 3}, {0.4f, 0.4f, 0.4f}, {0.4, 0.4, 0.4}},
    };
    const char *path = scratch_path(state, "colors.exr");
    for (size_t i = 0; i < sizeof k / sizeof *k; i++) {
        struct image im;
        struct photograph_record r;
        write_exr(path, k[i].rgb, 0.0, &k[i].colors);
        read_ok(path, JOB_TRANSFER_UNDECLARED, &im, &r);
        for (int c = 0; c < 3; c++)
            if (!(fabs((double)im.pixel[c] - k[i].want[c]) < 2e-4))
                fail_msg("case %zu: %g %g %g", i, (double)im.pixel[0], (double)im.pixel[1], (double)im.pixel[2]);
        image_release(&im);
        const struct file_statement *f = file_ledger_find(&r.info.ledger, "chromaticities");
        assert_true(f != NULL && f->use == FILE_STATEMENT_APPLIED);
    }
    struct error err = {0};
    struct image im;
    const struct job_photograph p = photograph_plain(JOB_TRANSFER_UNDECLARED);
    write_exr(path, k[0].rgb, 0.0, &(exr_attr_chromaticities_t){0.3f, 0.3f, 0.3f, 0.3f, 0.3f, 0.3f, 0.3127f, 0.329f});
    assert_int_equal(photograph_read(path, &p, &im, NULL, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, "'colors.exr': its chromaticities are no primaries"));
}

static void test_grey_of_few_bits(void **state)
{
    static uint16_t value[EDGE * EDGE];
    const char *path = scratch_path(state, "grey.png");
    for (unsigned depth = 1; depth <= 16; depth *= 2) {
        struct image im;
        struct photograph_record r;
        const unsigned largest = (1u << depth) - 1;
        for (size_t i = 0; i < EDGE * EDGE; i++) value[i] = (uint16_t)(i * 2654435761u >> 7 & largest);
        stated_write_png(path, EDGE - 1, EDGE, depth, 1, value, NULL, 0); /* rows that end within a byte */
        read_ok(path, JOB_TRANSFER_LINEAR, &im, &r);
        assert_int_equal(r.info.bits, depth);
        for (size_t i = 0; i < (EDGE - 1) * EDGE * 3; i++)
            assert_true(fabs((double)im.pixel[i] - (double)value[i / 3] / largest) < 1e-6);
        image_release(&im);
    }
}

/* The eight orientations in JPEG, PNG and TIFF, in both byte orders: the picture that viewers show is read. */
static void test_orientation(void **state)
{
    enum { WIDTH = 40, HEIGHT = 24 };
    static const uint16_t bits[3] = {8, 8, 8};
    static uint8_t folder[ROOM], marked[ROOM + 6] = "Exif\0", rgb[WIDTH * HEIGHT * 3], file[ROOM + sizeof rgb];
    static uint16_t word[WIDTH * HEIGHT * 3];
    const char *name[3] = {scratch_path(state, "o.jpg"), scratch_path(state, "o.png"), scratch_path(state, "o.tif")};
    for (unsigned k = 1; k <= 8; k++)
        for (int carrier = 0; carrier < 3; carrier++) {
            struct image im;
            struct photograph_record r;
            for (size_t i = 0; i < WIDTH * HEIGHT; i++) { /* stored pixel of the shown one with brightness by place */
                const size_t x = i % WIDTH, y = i / WIDTH, left = WIDTH - 1 - x, up = HEIGHT - 1 - y;
                /* where the first row and the first column are shown, by the table of the standard */
                const size_t shown_x[9] = {0, x, left, left, x, y, up, up, y},
                             shown_y[9] = {0, y, y, up, up, x, x, left, left};
                for (size_t c = 0; c < 3; c++)
                    word[3 * i + c] = rgb[3 * i + c] = (uint8_t)(c == 0   ? 4 * shown_x[k]
                                                                 : c == 1 ? 4 * shown_y[k]
                                                                          : 90);
            }
            const struct folder_entry one = {0x112, 3, k};
            size_t n = folder_build(k % 2 == 0, &one, 1, NULL, 0, folder, sizeof folder);
            memcpy(marked + 6, folder, n);
            if (carrier == 0)
                stated_write_jpeg(name[0], WIDTH, HEIGHT, rgb, &(struct file_part){NULL, 0xe1, marked, n + 6}, 1);
            if (carrier == 1)
                stated_write_png(name[1], WIDTH, HEIGHT, 8, 3, word, &(struct file_part){"eXIf", 0, folder, n}, 1);
            if (carrier == 2) {
                const struct folder_entry entry[] = {{256, 3, WIDTH},     {257, 3, HEIGHT}, {258, 3, 0, false, 3, bits},
                                                     {259, 3, 1},         {262, 3, 2},      {273, 4, 0},
                                                     {274, 3, k},         {277, 3, 3},      {278, 3, HEIGHT},
                                                     {279, 4, sizeof rgb}};
                n = folder_build(k % 2 == 0, entry, sizeof entry / sizeof *entry, rgb, sizeof rgb, file, sizeof file);
                scratch_write(name[2], (char *)file, n);
            }
            read_ok(name[carrier], JOB_TRANSFER_LINEAR, &im, &r);
            assert_true(im.width == (k < 5 ? WIDTH : HEIGHT) && im.height == (k < 5 ? HEIGHT : WIDTH));
            assert_true(r.info.orientation == k && file_ledger_find(&r.info.ledger, "orientation") != NULL);
            for (size_t y = 0; y < im.height; y++)
                for (size_t x = 0; x < im.width; x++) {
                    const float *p = im.pixel + 3 * (y * im.width + x);
                    const double allowed = carrier == 0 ? 0.012 : 1e-6; /* JPEG rounds */
                    if (!(fabs((double)p[0] - 4.0 * (double)x / 255.0) < allowed &&
                          fabs((double)p[1] - 4.0 * (double)y / 255.0) < allowed))
                        fail_msg("orientation %u of %s: (%zu, %zu) is %g %g", k, name[carrier], x, y,
                                 255.0 * (double)p[0] / 4, 255.0 * (double)p[1] / 4);
                }
            image_release(&im);
        }
}

/* Samples of twelve bits in the upper bits of a word: their largest value is white. */
static void test_largest_sample_in_upper_bits(void **state)
{
    static uint16_t word[EDGE * EDGE], largest = 4095 << 4;
    static uint8_t file[ROOM];
    const char *path = scratch_path(state, "upper.tif");
    struct image im;
    struct photograph_record r;
    for (size_t i = 0; i < EDGE * EDGE; i++) word[i] = (uint16_t)(i % 50 == 0 ? largest : (300 + i % 7) << 4);
    const struct folder_entry entry[] = {
        {256, 3, EDGE}, {257, 3, EDGE}, {258, 3, 16},   {259, 3, 1},           {262, 3, 1},
        {273, 4, 0},    {277, 3, 1},    {278, 3, EDGE}, {279, 4, sizeof word}, {281, 3, 0, false, 1, &largest}};
    const size_t n = folder_build(false, entry, sizeof entry / sizeof *entry, word, sizeof word, file, sizeof file);
    scratch_write(path, (char *)file, n);
    read_ok(path, JOB_TRANSFER_LINEAR, &im, &r);
    image_release(&im);
    assert_true(fabs(r.saturated_share - 12.0 / (EDGE * EDGE)) < 1e-9);
    assert_int_equal(file_ledger_find(&r.info.ledger, "MaxSampleValue")->use, FILE_STATEMENT_APPLIED);
}

/* Grey whose zero is white, and a largest sample that the file states. */
static void test_tags_of_tiff(void **state)
{
    static const uint16_t largest = 1023;
    static uint16_t word[EDGE * EDGE];
    static uint8_t file[ROOM];
    const char *path = scratch_path(state, "tags.tif");
    struct image im;
    struct photograph_record r;
    for (size_t i = 0; i < EDGE * EDGE; i++) word[i] = (uint16_t)(i % 50 == 0 ? 1023 : 300 + i % 7);
    for (int white = 0; white < 2; white++) {
        const struct folder_entry entry[] = {
            {256, 3, EDGE}, {257, 3, EDGE}, {258, 3, 16},   {259, 3, 1},           {262, 3, white ? 0 : 1},
            {273, 4, 0},    {277, 3, 1},    {278, 3, EDGE}, {279, 4, sizeof word}, {281, 3, 0, false, 1, &largest}};
        const size_t n = folder_build(false, entry, sizeof entry / sizeof *entry - (size_t)white, word, sizeof word,
                                      file, sizeof file);
        scratch_write(path, (char *)file, n);
        read_ok(path, JOB_TRANSFER_LINEAR, &im, &r);
        for (size_t i = 0; i < EDGE * EDGE; i++)
            assert_true(fabs((double)im.pixel[3 * i] - (white ? 65535 - word[i] : word[i]) / 65535.0) < 1e-6);
        image_release(&im);
        assert_true(white ? r.saturated_share == 0.0 : fabs(r.saturated_share - 12.0 / (EDGE * EDGE)) < 1e-9);
        assert_non_null(file_ledger_find(&r.info.ledger, white ? "photometric sense" : "MaxSampleValue"));
    }
}

/* XMP as attributes, as elements, and with a list; Exif data come first. */
static void test_xmp(void **state)
{
    static const char *const packet[] = {
        "<x:xmpmeta><rdf:Description exif:ExposureTime=\"1/10\" exif:FNumber=\"80/10\" tiff:Orientation=\"6\">"
        "<exif:ISOSpeedRatings><rdf:Seq><rdf:li>100</rdf:li></rdf:Seq></exif:ISOSpeedRatings></rdf:Description>",
        "<exif:ShutterSpeedValue>3321928/1000000</exif:ShutterSpeedValue> <exif:ApertureValue>6/1</exif:ApertureValue>"
        "<exifEX:PhotographicSensitivity>100</exifEX:PhotographicSensitivity><tiff:Orientation> 6 </tiff:Orientation>"};
    static uint8_t marker[ROOM], rgb[EDGE * EDGE * 3], folder[ROOM];
    static uint16_t word[EDGE * EDGE * 3];
    const char *jpeg = scratch_path(state, "x.jpg"), *png = scratch_path(state, "x.png");
    for (size_t i = 0; i < EDGE * EDGE * 3; i++) word[i] = rgb[i] = (uint8_t)(100 + i % 7);
    for (int k = 0; k < 2; k++) {
        struct image im;
        struct photograph_record r;
        memcpy(marker, "http://ns.adobe.com/xap/1.0/", 29);
        memcpy(marker + 29, packet[k], strlen(packet[k]));
        stated_write_jpeg(jpeg, EDGE, EDGE, rgb, &(struct file_part){NULL, 0xe1, marker, 29 + strlen(packet[k])}, 1);
        check_exposure(jpeg, JOB_TRANSFER_SRGB, 0.1, 8.0, 100.0);
        memcpy(marker, "XML:com.adobe.xmp\0\0\0\0", 22);
        memcpy(marker + 22, packet[k], strlen(packet[k]));
        const struct file_part text = {"iTXt", 0, marker, 22 + strlen(packet[k])};
        stated_write_png(png, EDGE, EDGE, 8, 3, word, &text, 1);
        check_exposure(png, JOB_TRANSFER_SRGB, 0.1, 8.0, 100.0);
        read_ok(png, JOB_TRANSFER_SRGB, &im, &r);
        image_release(&im);
        assert_int_equal(r.info.orientation, 6);
        const struct folder_entry exif = {0x829a, 5, 0.5, true};
        const size_t n_folder = folder_build(true, &exif, 1, NULL, 0, folder, sizeof folder);
        stated_write_png(png, EDGE, EDGE, 8, 3, word, (struct file_part[]){{"eXIf", 0, folder, n_folder}, text}, 2);
        check_exposure(png, JOB_TRANSFER_SRGB, 0.5, 8.0, 100.0);
    }
}

/* A picture whose curve nobody declared has the curve of its file, else the assumed one. */
static void test_assumed_transfer(void **state)
{
    static uint16_t word[EDGE * EDGE];
    const char *path = scratch_path(state, "assumed.png");
    const struct file_part linear = {"gAMA", 0, "\0\1\x86\xa0", 4};
    for (size_t i = 0; i < EDGE * EDGE; i++) word[i] = (uint16_t)(20000 + 50 * i);
    for (size_t n = 0; n < 2; n++) {
        struct image im;
        const struct job_photograph p = photograph_assumed(JOB_TRANSFER_SRGB);
        stated_write_png(path, EDGE, EDGE, 16, 1, word, &linear, n);
        assert_int_equal(photograph_read(path, &p, &im, NULL, NULL), STATUS_OK);
        const double v = word[7] / 65535.0, want = n == 1 ? v : pow((v + 0.055) / 1.055, 2.4);
        assert_true(fabs((double)im.pixel[21] - want) < 1e-5);
        image_release(&im);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_exposure_of_exif),
        cmocka_unit_test(test_exposure_of_tiff),
        cmocka_unit_test(test_exposures_that_are_none),
        cmocka_unit_test(test_statements_of_exr),
        cmocka_unit_test(test_primaries_of_exr),
        cmocka_unit_test(test_grey_of_few_bits),
        cmocka_unit_test(test_orientation),
        cmocka_unit_test(test_largest_sample_in_upper_bits),
        cmocka_unit_test(test_tags_of_tiff),
        cmocka_unit_test(test_xmp),
        cmocka_unit_test(test_assumed_transfer),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
