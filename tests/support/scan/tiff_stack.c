#include "tests/support/scan/tiff_stack.h"
#include "geometry/volume/format/volume_source.h"

#include "base/option_id.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static char folder[64];

void stack_path(char path[128], const char *name) { snprintf(path, 128, "%s/%s", folder, name); }

int stack_folder_setup(void **state)
{
    (void)state;
    test_make_folder(folder);
    return 0;
}

static float stack_expected(size_t page, size_t i, uint16_t bits)
{
    size_t x = (page * 7919u + i * 31u) % (bits == 8 ? 251u : 65521u);
    return bits == 32 ? (float)x * 0.25f - 3.0f : (float)x;
}

void *stack_pixels(size_t page, uint16_t bits)
{
    uint8_t *p = malloc((size_t)STACK_WIDTH * STACK_HEIGHT * 4);
    for (size_t i = 0; i < STACK_WIDTH * STACK_HEIGHT; i++) {
        float x = stack_expected(page, i, bits);
        uint16_t u16 = (uint16_t)(bits == 32 ? 0.0f : x);
        if (bits == 8) p[i] = (uint8_t)x;
        if (bits == 16) memcpy(p + 2 * i, &u16, 2);
        if (bits == 32) memcpy(p + 4 * i, &x, 4);
    }
    return p;
}

void stack_write(const char *path, uint16_t bits, size_t n_page, uint16_t compression, enum test_tiff_layout layout)
{
    struct test_page page[STACK_PAGES] = {0};
    for (size_t i = 0; i < n_page; i++)
        page[i] = (struct test_page){STACK_WIDTH, STACK_HEIGHT, bits, stack_pixels(i, bits)};
    test_write_tiff(path, page, n_page, compression, layout);
    for (size_t i = 0; i < n_page; i++) free((void *)(uintptr_t)page[i].pixel);
}

void stack_check(const char *const *path, size_t n_path, uint16_t bits)
{
    struct error err = {0};
    struct volume_source *s;
    float value[2 * STACK_WIDTH * STACK_HEIGHT];
    assert_int_equal(volume_source_open(path, n_path, &s, &err), STATUS_OK);
    assert_int_equal(volume_source_describe(s)->n[0], STACK_WIDTH);
    assert_int_equal(volume_source_describe(s)->n[1], STACK_HEIGHT);
    assert_int_equal(volume_source_describe(s)->n[2], STACK_PAGES);
    for (int from = 2; from >= 0; from -= 2) { /* also in reverse order */
        assert_int_equal(volume_source_read(s, (size_t)from, 2, value, &err), STATUS_OK);
        for (size_t i = 0; i < 2 * STACK_WIDTH * STACK_HEIGHT; i++)
            assert_true(value[i] == stack_expected((size_t)from + i / (STACK_WIDTH * STACK_HEIGHT),
                                                   i % (STACK_WIDTH * STACK_HEIGHT), bits));
    }
    assert_int_equal(volume_source_read(s, 3, 2, value, &err), STATUS_INTERNAL);
    volume_source_close(s);
}

void stack_expect_open_error(const char *path, status code, const char *text)
{
    struct error err = {0};
    struct volume_source *s = NULL;
    if (volume_source_open(&path, 1, &s, &err) != code) fail_msg("%s: %s", status_name(err.code), err.text);
    assert_null(s);
    if (strstr(err.text, text) == NULL) fail_msg("'%s' lacks '%s'", err.text, text);
    assert_string_equal(err.field, OPTION_SCAN_FILES);
}

size_t tiff_read_bytes(const char *path, uint8_t *data, size_t room)
{
    FILE *f = fopen(path, "rb");
    size_t n = fread(data, 1, room, f);
    fclose(f);
    return n;
}

/* The tag stands in the first directory of a little-endian file with 32-bit offsets. */
void tiff_patch_tag(uint8_t *data, uint16_t tag, uint32_t value)
{
    uint32_t at;
    uint16_t n, id, type = 4;
    memcpy(&at, data + 4, 4);
    memcpy(&n, data + at, 2);
    for (uint8_t *e = data + at + 2; n > 0; n--, e += 12) {
        memcpy(&id, e, 2);
        if (id != tag) continue;
        memcpy(e + 2, &type, 2);
        memcpy(e + 4, &(uint32_t){1}, 4);
        memcpy(e + 8, &value, 4);
        return;
    }
    fail_msg("tag %u not found", tag);
}
