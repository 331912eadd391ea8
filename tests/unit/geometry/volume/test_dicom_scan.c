/* Scans in DICOM: a file for each slice, in the order of their positions, and one file of several frames. */
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

enum { IMPLICIT, EXPLICIT, BIG, JPEG, N_SYNTAX };
static const char *const uid[N_SYNTAX] = {"1.2.840.10008.1.2", "1.2.840.10008.1.2.1", "1.2.840.10008.1.2.2",
                                          "1.2.840.10008.1.2.4.70"};

struct writer {
    uint8_t byte[4096];
    size_t n;
    int syntax;
};

static void put(struct writer *w, uint64_t bits, size_t n, bool big)
{
    for (size_t i = 0; i < n; i++) w->byte[w->n++] = (uint8_t)(bits >> 8 * (big ? n - 1 - i : i));
}

static void element(struct writer *w, uint32_t tag, const char *vr, const void *value, size_t n)
{
    const bool is_meta = tag >> 16 == 2, big = !is_meta && w->syntax == BIG;
    put(w, tag >> 16, 2, big);
    put(w, tag & 0xffff, 2, big);
    if (is_meta || w->syntax != IMPLICIT) {
        memcpy(w->byte + w->n, vr, 2);
        w->n += 2;
        if (strcmp(vr, "OW") == 0 || strcmp(vr, "SQ") == 0) {
            put(w, 0, 2, big);
            put(w, n, 4, big);
        } else
            put(w, n, 2, big);
    } else
        put(w, n, 4, big);
    memcpy(w->byte + w->n, value, n);
    w->n += n;
}

static void text(struct writer *w, uint32_t tag, const char *vr, const char *value)
{
    char even[128];
    const size_t n = strlen(value);
    snprintf(even, sizeof even, "%s ", value);
    element(w, tag, vr, even, n + n % 2);
}

static void whole(struct writer *w, uint32_t tag, unsigned value)
{
    const uint8_t b[2] = {(uint8_t)(w->syntax == BIG ? value >> 8 : value),
                          (uint8_t)(w->syntax == BIG ? value : value >> 8)};
    element(w, tag, "US", b, 2);
}

/* A slice of 2 x 1 pixels. */
struct slice {
    int syntax, is_signed, bits_stored, instance;
    double z;
    const char *series, *photometric, *position, *orientation, *scale, *frames, *padding, *spacing;
    uint16_t value[4];
    struct {
        uint32_t tag;
        const char *vr, *value;
        size_t n;
    } more; /* an element that other slices do not have; tag 0: none */
};

static const struct slice plain = {.syntax = EXPLICIT,
                                   .bits_stored = 16,
                                   .instance = 1,
                                   .series = "1.2.3",
                                   .photometric = "MONOCHROME2",
                                   .orientation = "1\\0\\0\\0\\1\\0",
                                   .spacing = "0.003\\0.002",
                                   .value = {1, 2, 3, 4}};

static struct writer slice_bytes(const struct slice *s)
{
    struct writer w = {.n = 128, .syntax = s->syntax};
    char at[64];
    memcpy(w.byte + 128, "DICM", 4);
    w.n = 132;
    text(&w, 0x00020010, "UI", uid[s->syntax]);
    /* an icon, whose samples and sizes are others */
    struct writer icon = {.syntax = s->syntax};
    whole(&icon, 0x00280010, 77);
    struct writer item = {.syntax = s->syntax};
    put(&item, 0xfffe, 2, s->syntax == BIG);
    put(&item, 0xe000, 2, s->syntax == BIG);
    put(&item, icon.n, 4, s->syntax == BIG);
    memcpy(item.byte + item.n, icon.byte, icon.n);
    item.n += icon.n;
    text(&w, 0x00180050, "DS", "0.009");
    text(&w, 0x0020000e, "UI", s->series);
    snprintf(at, sizeof at, "%d", s->instance);
    text(&w, 0x00200013, "IS", at);
    snprintf(at, sizeof at, "0\\0\\%.6g", s->z);
    if (s->position == NULL || s->position[0] != '\0')
        text(&w, 0x00200032, "DS", s->position != NULL ? s->position : at);
    text(&w, 0x00200037, "DS", s->orientation);
    whole(&w, 0x00280002, strcmp(s->photometric, "RGB") == 0 ? 3 : 1);
    text(&w, 0x00280004, "CS", s->photometric);
    if (s->frames != NULL) text(&w, 0x00280008, "IS", s->frames);
    whole(&w, 0x00280010, 1);
    whole(&w, 0x00280011, 2);
    text(&w, 0x00280030, "DS", s->spacing);
    whole(&w, 0x00280100, 16);
    whole(&w, 0x00280101, (unsigned)s->bits_stored);
    whole(&w, 0x00280102, (unsigned)s->bits_stored - 1);
    whole(&w, 0x00280103, (unsigned)s->is_signed);
    if (s->scale != NULL) {
        text(&w, 0x00281052, "DS", "-10");
        text(&w, 0x00281053, "DS", s->scale);
    }
    if (s->padding != NULL) element(&w, 0x00280120, "US", s->padding, 2);
    if (s->more.tag != 0) element(&w, s->more.tag, s->more.vr, s->more.value, s->more.n);
    if (s->syntax == IMPLICIT) element(&w, 0x00880200, "SQ", item.byte, item.n);
    uint8_t sample[8];
    for (int i = 0; i < 4; i++) {
        sample[2 * i] = (uint8_t)(s->syntax == BIG ? s->value[i] >> 8 : s->value[i]);
        sample[2 * i + 1] = (uint8_t)(s->syntax == BIG ? s->value[i] : s->value[i] >> 8);
    }
    element(&w, 0x7fe00010, "OW", sample, s->frames != NULL ? 8 : 4);
    return w;
}

static char *names[3];

static const char *const *write_slices(void **state, const struct slice *s, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        char name[16];
        const struct writer w = slice_bytes(&s[i]);
        snprintf(name, sizeof name, "%c.dcm", (char)('a' + i));
        free(names[i]);
        names[i] = strdup(scratch_path(state, name));
        scratch_write(names[i], w.byte, w.n);
    }
    return (const char *const *)names;
}

static void test_order(void **state)
{
    static const size_t n[3] = {2, 1, 3};
    static const double mm[3] = {0.002, 0.003, 0.004};
    static const float want[6] = {5, 6, 3, 4, 1, 2};
    for (int syntax = IMPLICIT; syntax <= BIG; syntax++) {
        struct slice s[3] = {plain, plain, plain};
        for (int i = 0; i < 3; i++) {
            s[i].syntax = syntax;
            s[i].z = -0.004 * i;
            s[i].value[0] = (uint16_t)(2 * i + 1);
            s[i].value[1] = (uint16_t)(2 * i + 2);
        }
        scan_expect_values(write_slices(state, s, 3), 3, NULL, n, mm, want);
        struct slice swapped[3] = {s[1], s[2], s[0]}; /* names mean nothing */
        scan_expect_values(write_slices(state, swapped, 3), 3, NULL, n, mm, want);
        for (int i = 0; i < 3; i++) {
            s[i].position = "";
            s[i].instance = 3 - i;
        }
        scan_expect_values(write_slices(state, s, 3), 3, NULL, n, (const double[3]){0, 0, 0}, want);
    }
}

static void test_values(void **state)
{
    struct slice s = plain;
    static const size_t n[3] = {2, 1, 1};
    static const double none[3] = {0, 0, 0};
    s.bits_stored = 12;
    s.value[0] = 0xf001; /* bits above the stored ones mean nothing */
    s.value[1] = 0x0fff;
    scan_expect_values(write_slices(state, &s, 1), 1, NULL, n, none, (const float[2]){1, 4095});
    s.is_signed = 1;
    scan_expect_values(write_slices(state, &s, 1), 1, NULL, n, none, (const float[2]){1, -1});
    s.scale = "2";
    scan_expect_values(write_slices(state, &s, 1), 1, NULL, n, none, (const float[2]){-8, -12});
    s = plain;
    s.photometric = "MONOCHROME1";
    s.bits_stored = 12;
    scan_expect_values(write_slices(state, &s, 1), 1, NULL, n, none, (const float[2]){4094, 4093});
    s = plain;
    s.frames = "2";
    s.position = "";
    scan_expect_values(write_slices(state, &s, 1), 1, NULL, (const size_t[3]){2, 1, 2}, none,
                       (const float[4]){1, 2, 3, 4});
}

static void expect_open(void **state, const struct slice *s, size_t n, status code, const char *part)
{
    struct volume_source *source = NULL;
    struct error err = {0};
    const status got = volume_source_open(write_slices(state, s, n), n, &source, &err);
    if (got != code || strstr(err.text, part) == NULL) fail_msg("%s: %d, %s", part, got, err.text);
    assert_string_equal(err.field, OPTION_SCAN_FILES);
}

static void test_refused(void **state)
{
    struct slice s[3] = {plain, plain, plain};
    s[1].z = 0.004;
    s[2].z = 0.012;
    expect_open(state, s, 3, STATUS_INVALID, "slices are missing between it and 'c.dcm'");
    s[2].z = 0.004;
    expect_open(state, s, 3, STATUS_INVALID, "at the same place");
    s[2].z = 0.008;
    s[2].series = "9.9";
    expect_open(state, s, 3, STATUS_INVALID, "several series: 'a.dcm' is of '1.2.3', 'c.dcm' of '9.9'");
    s[2] = plain;
    s[2].z = 0.008;
    s[2].bits_stored = 12;
    expect_open(state, s, 3, STATUS_FORMAT, "of another type");
    s[0].syntax = JPEG;
    expect_open(state, s, 1, STATUS_UNSUPPORTED, "compressed by JPEG (transfer syntax '1.2.840.10008.1.2.4.70')");
    s[0] = plain;
    s[0].photometric = "RGB";
    expect_open(state, s, 1, STATUS_FORMAT, "colors ('RGB', 3 samples a pixel)");
    s[0] = plain;
    s[0].frames = "9";
    expect_open(state, s, 1, STATUS_FORMAT, "too short for its frames");
    const struct volume_part second = {.channel = 2};
    struct volume_source *none = NULL;
    const char *const *one = write_slices(state, &plain, 1);
    assert_int_equal(volume_source_open_declared(one, 1, NULL, &second, &none, NULL), STATUS_INVALID);
    const struct writer whole_file = slice_bytes(&plain);
    const char *path = scratch_path(state, "cut.dcm");
    for (size_t n = 132; n < whole_file.n; n++) {
        struct volume_source *source = NULL;
        struct error err = {0};
        scratch_write(path, whole_file.byte, n);
        assert_int_not_equal(volume_source_open(&path, 1, &source, &err), STATUS_OK);
        assert_non_null(strstr(err.text, "'cut.dcm'"));
    }
}

static void test_directions(void **state)
{
    static const struct {
        const char *orientation, *second, *axes;
    } c[] = {{"1\\0\\0\\0\\1\\0", "0\\0\\0.004", "xyz"},
             {"1\\0\\0\\0\\0\\-1", "0\\0.004\\0", "xz-y"},
             {"-1\\0\\0\\0\\1\\0", "0\\0\\-0.004", "-xy-z"},
             {"1\\0\\0\\0\\1\\0", "0\\0.002\\0.004", ""}};
    for (size_t i = 0; i < sizeof c / sizeof *c; i++) {
        struct slice s[2] = {plain, plain};
        struct volume_source *source = NULL;
        struct error err = {0};
        for (int k = 0; k < 2; k++) s[k].orientation = c[i].orientation;
        s[1].position = c[i].second;
        if (volume_source_open(write_slices(state, s, 2), 2, &source, &err) != STATUS_OK) fail_msg("%s", err.text);
        const struct volume_source_info *info = volume_source_describe(source);
        if (strcmp(info->axes, c[i].axes) != 0 || info->is_oblique != (c[i].axes[0] == '\0'))
            fail_msg("case %zu: '%s'", i, info->axes);
        assert_int_equal(file_ledger_find(&info->ledger, "thickness of slices")->use, FILE_STATEMENT_NOT_USED);
        assert_int_equal(file_ledger_find(&info->ledger, "order of slices")->use, FILE_STATEMENT_APPLIED);
        volume_source_close(source);
    }
}

/* What would change the values or the place of slices, and no reader could show. */
static void test_refused_statements(void **state)
{
    struct slice s[3] = {plain, plain, plain};
    s[0].frames = "1";
    expect_open(state, s, 1, STATUS_FORMAT, "longer than its frames");
    s[0] = plain;
    s[0].more.tag = 0x00283000;
    s[0].more.vr = "SQ";
    expect_open(state, s, 1, STATUS_FORMAT, "ModalityLUTSequence");
    s[0] = plain;
    s[0].frames = "2";
    s[0].more.tag = 0x00280009; /* of FrameTime */
    s[0].more.vr = "AT";
    s[0].more.value = "\x18\0\x63\x10";
    s[0].more.n = 4;
    expect_open(state, s, 1, STATUS_FORMAT, "frames are times");
    s[0] = plain;
    s[0].more.tag = 0x00280010;
    s[0].more.vr = "UL";
    s[0].more.value = "\1\0\x10\0";
    s[0].more.n = 4;
    expect_open(state, s, 1, STATUS_FORMAT, "impossible size");
    s[0] = plain;
    s[1].z = 0.004;
    s[1].position = "0\\0.004\\0.004";
    s[2].z = 0.008;
    expect_open(state, s, 3, STATUS_INVALID, "'b.dcm': its position is not on the line of the other slices");
    const struct volume_part part = {.channel = 2};
    struct volume_source *source = NULL;
    struct error err = {0};
    s[0] = plain;
    assert_int_equal(volume_source_open_declared(write_slices(state, s, 1), 1, NULL, &part, &source, &err),
                     STATUS_INVALID);
    assert_string_equal(err.field, OPTION_SCAN_CHANNEL);
}

/* Writers round positions: 2.5 um in thousandths of a millimetre. */
static void test_rounded_positions(void **state)
{
    struct slice s[3] = {plain, plain, plain};
    s[1].z = 0.002;
    s[2].z = 0.005;
    scan_expect_values(write_slices(state, s, 3), 3, NULL, (const size_t[3]){2, 1, 3},
                       (const double[3]){0.002, 0.003, 0.0025}, (const float[6]){1, 2, 1, 2, 1, 2});
}

static struct volume_source_info info_of(void **state, const struct slice *s, size_t n)
{
    struct volume_source *source = NULL;
    struct error err = {0};
    if (volume_source_open(write_slices(state, s, n), n, &source, &err) != STATUS_OK) fail_msg("%s", err.text);
    const struct volume_source_info info = *volume_source_describe(source);
    volume_source_close(source);
    return info;
}

static void test_statements(void **state)
{
    static const struct {
        uint32_t tag;
        const char *vr, *value, *name;
    } c[] = {{0x00181164, "DS", "0.1\\0.1 ", "pixels of the detector"},
             {0x00281050, "DS", "40", "range of display"},
             {0x00282110, "CS", "01", "lossy compression"},
             {0x00080060, "CS", "CT", "modality"}};
    for (size_t i = 0; i < sizeof c / sizeof *c; i++) {
        struct slice s = plain;
        s.more.tag = c[i].tag;
        s.more.vr = c[i].vr;
        s.more.value = c[i].value;
        s.more.n = strlen(c[i].value);
        const struct volume_source_info info = info_of(state, &s, 1);
        const struct file_statement *found = file_ledger_find(&info.ledger, c[i].name);
        if (found == NULL || found->use != FILE_STATEMENT_NOT_USED) fail_msg("%s", c[i].name);
    }
    struct slice s[2] = {plain, plain};
    s[1].z = 0.004;
    s[0].padding = s[1].padding = "\7\0";
    assert_true(info_of(state, s, 2).padding == 7.0);
    s[0].scale = "2";
    s[1].scale = "3"; /* 7 then stands for 4 and for 11 */
    struct volume_source_info info = info_of(state, s, 2);
    assert_true(isnan(info.padding));
    assert_int_equal(file_ledger_find(&info.ledger, "padding value")->use, FILE_STATEMENT_NOT_USED);
    assert_non_null(strstr(file_ledger_find(&info.ledger, "scale of values")->value, "each file"));
    s[1].scale = "2";
    s[0].more.tag = s[1].more.tag = 0x00280121;
    s[0].more.vr = s[1].more.vr = "US";
    s[0].more.value = s[1].more.value = "\x09\0";
    s[0].more.n = s[1].more.n = 2;
    info = info_of(state, s, 2);
    assert_true(isnan(info.padding));
    assert_int_equal(file_ledger_find(&info.ledger, "padding value")->use, FILE_STATEMENT_NOT_USED);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_order),
        cmocka_unit_test(test_values),
        cmocka_unit_test(test_refused),
        cmocka_unit_test(test_directions),
        cmocka_unit_test(test_refused_statements),
        cmocka_unit_test(test_rounded_positions),
        cmocka_unit_test(test_statements),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
