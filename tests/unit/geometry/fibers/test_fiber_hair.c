/* Yuksel's .hair: golden bytes, files of other programs, damaged files. */
#include "geometry/fibers/fiber_set.h"
#include "tests/support/scratch_folder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { HEADER = 128 };

/* One fiber from (0, 0, 0) to (1, 0, 0) mm, diameter 0.5 mm, tile 1 x 2 mm. */
static const unsigned char golden[HEADER + 2 + 24 + 8] = {
    'H',  'A', 'I',  'R',  1,    0,    0,    0,   2,    0,    0,    0,   7,
    0,    0,   0,    0,    0,    0,    0,    0,   0,    0,    0x3f, 0,   0,
    0,    0,   0,    0,    0x80, 0x3f, 0,    0,   0x80, 0x3f, 0,    0,   0x80,
    0x3f, 's', 'e',  'l',  'v',  'e',  'd',  'g', 'e',  ' ',  't',  'i', 'l',
    'e',  '_', 'm',  'm',  '=',  '1',  ',',  '2', 0,    0,    0,    0,   [HEADER] = 1,
    0,    0,   0,    0,    0,    0,    0,    0,   0,    0,    0,    0,   0,
    0,    0,   0x80, 0x3f, 0,    0,    0,    0,   0,    0,    0,    0,   0,
    0,    0,   0x3f, 0,    0,    0,    0x3f,
};

static struct fiber_set one_fiber(size_t n_vertex)
{
    struct fiber_set f;
    fiber_set_init(&f);
    f.tile_size_m[0] = 1e-3;
    f.tile_size_m[1] = 2e-3;
    assert_int_equal(fiber_set_reserve(&f, 1, n_vertex, NULL), STATUS_OK);
    f.first_vertex[1] = n_vertex;
    memset(f.position_m, 0, 3 * n_vertex * sizeof *f.position_m);
    for (size_t k = 0; k < n_vertex; k++) f.position_m[3 * k] = 1e-3f * (float)k / (float)(n_vertex - 1);
    f.radius_m[0] = 2.5e-4f;
    return f;
}

static void test_golden_bytes(void **state)
{
    const char *path = scratch_path(state, "golden.hair");
    struct fiber_set f = one_fiber(2), g;
    size_t n;
    fiber_set_init(&g);
    assert_int_equal(fiber_set_write_hair(&f, path, NULL), STATUS_OK);
    char *data = scratch_read(path, &n);
    assert_int_equal(n, sizeof golden);
    assert_memory_equal(data, golden, n);
    free(data);
    assert_int_equal(fiber_set_read_hair(&g, path, NULL), STATUS_OK);
    assert_memory_equal(g.position_m, f.position_m, 6 * sizeof(float));
    assert_true(g.radius_m[0] == f.radius_m[0]);
    assert_true(g.tile_size_m[0] == 1e-3 && g.tile_size_m[1] == 2e-3);
    assert_int_equal(fiber_set_validate(&g, NULL), STATUS_OK);
    fiber_set_release(&f);
    fiber_set_release(&g);
}

static void test_round_trip_of_many(void **state)
{
    enum { N = 50 };
    const char *path = scratch_path(state, "many.hair");
    struct fiber_set f, g;
    fiber_set_init(&f);
    fiber_set_init(&g);
    f.tile_size_m[0] = 0.000398;
    f.tile_size_m[1] = 1.0 / 3000.0;
    assert_int_equal(fiber_set_reserve(&f, N, N * (N + 3) / 2, NULL), STATUS_OK);
    for (size_t i = 0, k = 0; i < N; i++) {
        for (size_t j = 0; j < i + 2; j++, k++)
            for (size_t a = 0; a < 3; a++)
                f.position_m[3 * k + a] = 1e-6f * (float)((i * 37 + j * (a == i % 3 ? 50 : 3) + a) % 9973);
        f.first_vertex[i + 1] = k;
        f.radius_m[i] = 1e-6f * (float)(i + 1);
    }
    fiber_set_classify(&f);
    assert_int_equal(fiber_set_write_hair(&f, path, NULL), STATUS_OK);
    assert_int_equal(fiber_set_read_hair(&g, path, NULL), STATUS_OK);
    assert_int_equal(g.n_vertex, f.n_vertex);
    assert_memory_equal(g.first_vertex, f.first_vertex, (N + 1) * sizeof *f.first_vertex);
    assert_memory_equal(g.axis_class, f.axis_class, N);
    for (size_t k = 0; k < 3 * f.n_vertex; k++)
        assert_true(fabsf(g.position_m[k] - f.position_m[k]) <= 2.4e-7f * fabsf(f.position_m[k]));
    for (int a = 0; a < 2; a++) assert_true(fabs(g.tile_size_m[a] / f.tile_size_m[a] - 1.0) < 1e-15);
    fiber_set_release(&f);
    fiber_set_release(&g);
}

/* Bytes of a file of eight fibers of three vertices, fiber i in group group[i]; *f: the same, to be released. */
static char *write_groups(const char *path, const uint8_t group[8], struct fiber_set *f, size_t *n)
{
    fiber_set_init(f);
    f->tile_size_m[0] = f->tile_size_m[1] = 0.1234567890123456789e-3; /* the longest text */
    assert_int_equal(fiber_set_reserve(f, 8, 24, NULL), STATUS_OK);
    for (size_t i = 0; i < 8; i++) {
        f->first_vertex[i + 1] = 3 * (i + 1);
        f->radius_m[i] = 1e-5f;
        f->group[i] = group[i];
    }
    for (size_t k = 0; k < 72; k++) f->position_m[k] = 1e-5f * (float)(k % 9 + k / 9);
    assert_int_equal(fiber_set_write_hair(f, path, NULL), STATUS_OK);
    return scratch_read(path, n);
}

static void test_groups_round_trip(void **state)
{
    static const uint8_t all[8] = {3, 0, 1, 2, 7, 6, 5, 4}, none[8] = {0};
    const char *path = scratch_path(state, "groups.hair");
    struct fiber_set f, g, plain;
    size_t n, n_plain;
    fiber_set_init(&g);
    char *data = write_groups(path, all, &f, &n);
    assert_int_equal(fiber_set_read_hair(&g, path, NULL), STATUS_OK);
    assert_memory_equal(g.group, all, 8);
    assert_true(g.tile_size_m[1] == f.tile_size_m[1]);
    char *without = write_groups(path, none, &plain, &n_plain); /* no colours, and otherwise the same bytes */
    assert_int_equal(n, n_plain + 24 * 12);
    assert_memory_equal(data + HEADER, without + HEADER, n_plain - HEADER);
    assert_int_equal(without[12], 7);
    assert_null(strstr(without + 40, "groups"));
    data[n - 1] = 0x3e; /* the last point's colour: neither 0 nor 1 */
    scratch_write(path, data, n);
    struct error err = {0};
    assert_int_equal(fiber_set_read_hair(&g, path, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, "the colours of fiber 7"));
    memcpy(data + 40, "unknown", 7); /* without the text colours are only colours */
    scratch_write(path, data, n);
    assert_int_equal(fiber_set_read_hair(&g, path, NULL), STATUS_OK);
    assert_memory_equal(g.group, none, 8);
    free(data);
    free(without);
    fiber_set_release(&f);
    fiber_set_release(&g);
    fiber_set_release(&plain);
}

static void test_longest_fiber(void **state)
{
    const char *path = scratch_path(state, "long.hair");
    struct error err;
    struct fiber_set f = one_fiber(65536), g;
    fiber_set_init(&g);
    assert_int_equal(fiber_set_write_hair(&f, path, NULL), STATUS_OK);
    assert_int_equal(fiber_set_read_hair(&g, path, NULL), STATUS_OK);
    assert_int_equal(g.n_vertex, 65536);
    fiber_set_release(&f);
    /* longer ones in pieces that share a vertex; nothing is lost */
    static const size_t longer[][3] = {
        {65537, 2, 2}, {131071, 2, 65536}, {131072, 3, 2}, {200000, 4, 200000 - 3 * 65535}};
    for (size_t i = 0; i < sizeof longer / sizeof longer[0]; i++) {
        size_t n = longer[i][0], n_piece = longer[i][1], k = 0;
        f = one_fiber(n);
        assert_int_equal(fiber_set_write_hair(&f, path, NULL), STATUS_OK);
        assert_int_equal(fiber_set_read_hair(&g, path, NULL), STATUS_OK);
        assert_int_equal(g.n_fiber, n_piece);
        assert_int_equal(g.n_vertex, n + n_piece - 1);
        assert_int_equal(g.first_vertex[n_piece] - g.first_vertex[n_piece - 1], longer[i][2]);
        for (size_t p = 0; p < n_piece; p++, k--) { /* k: of the whole fiber */
            assert_true(fabsf(g.radius_m[p] / f.radius_m[0] - 1.0f) < 1e-5f);
            for (size_t v = g.first_vertex[p]; v < g.first_vertex[p + 1]; v++, k++)
                for (size_t a = 0; a < 3; a++)
                    assert_true(fabsf(g.position_m[3 * v + a] - f.position_m[3 * k + a]) <=
                                2.4e-7f * fabsf(f.position_m[3 * k + a]));
        }
        assert_int_equal(k + 1, n);
        fiber_set_release(&f);
    }
    fiber_set_release(&g);
    f = one_fiber(2); /* errors of writing do not name the server's folders either */
    f.first_vertex[1] = 1;
    assert_int_equal(fiber_set_write_hair(&f, path, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "fibers 'long.hair'"));
    fiber_set_release(&f);
}

static void put_u32(unsigned char *to, uint32_t v) { memcpy(to, &v, 4); }
static void put_f32(unsigned char *to, float v) { memcpy(to, &v, 4); }

/* Two strands of 2 segments each, without arrays but points unless flags say so. */
static size_t other_program(unsigned char *to, uint32_t flags, float default_thickness)
{
    memset(to, 0, 512);
    memcpy(to, "HAIR", 4);
    put_u32(to + 4, 2);
    put_u32(to + 8, 6);
    put_u32(to + 12, flags);
    put_u32(to + 16, 2);
    put_f32(to + 20, default_thickness);
    memset(to + 40, 'x', 88); /* no NUL at the end of the text */
    size_t n = HEADER;
    if (flags & 1) {
        to[n] = to[n + 2] = 2;
        n += 4;
    }
    for (size_t k = 0; k < 6; k++) put_f32(to + n + 12 * k + 4, (float)k);
    n += 72;
    if (flags & 4)
        for (size_t k = 0; k < 6; k++, n += 4) put_f32(to + n, 1.0f + (float)(k % 3));
    if (flags & 8) n += 24;
    if (flags & 16) n += 72;
    return n;
}

static void test_files_of_other_programs(void **state)
{
    unsigned char data[512];
    const char *path = scratch_path(state, "other.hair");
    for (uint32_t flags = 2; flags < 32; flags++) {
        if ((flags & 2) == 0) continue;
        struct fiber_set f;
        fiber_set_init(&f);
        scratch_write(path, data, other_program(data, flags, 0.5f));
        assert_int_equal(fiber_set_read_hair(&f, path, NULL), STATUS_OK);
        assert_int_equal(f.n_fiber, 2);
        assert_int_equal(f.first_vertex[1], 3);
        assert_int_equal(f.axis_class[1], 1);
        assert_true(fabsf(f.radius_m[0] - (flags & 4 ? 1e-3f : 0.25e-3f)) < 1e-9f); /* half the mean thickness */
        assert_true(f.tile_size_m[0] == 0.0 && f.tile_size_m[1] == 0.0);
        fiber_set_release(&f);
    }
}

static void test_no_thickness_is_an_error(void **state)
{
    unsigned char data[512];
    const char *path = scratch_path(state, "thin.hair");
    struct fiber_set f;
    struct error err;
    fiber_set_init(&f);
    scratch_write(path, data, other_program(data, 3, 0.0f));
    assert_int_equal(fiber_set_read_hair(&f, path, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "states no radius"));
    fiber_set_release(&f);
}

static void expect_damaged(void **state, const unsigned char *data, size_t n)
{
    const char *path = scratch_path(state, "damaged.hair");
    struct error err = {0};
    struct fiber_set f = one_fiber(2);
    scratch_write(path, data, n);
    assert_int_equal(fiber_set_read_hair(&f, path, &err), STATUS_FORMAT);
    assert_non_null(strstr(err.text, "'damaged.hair'")); /* the user's name for it, not the server's */
    assert_int_equal(f.n_vertex, 2);                     /* left as it was */
    fiber_set_release(&f);
}

static void test_damaged_files(void **state)
{
    unsigned char data[sizeof golden + 1];
    struct error err;
    struct fiber_set f;
    fiber_set_init(&f);
    for (size_t n = 0; n < sizeof golden; n++) expect_damaged(state, golden, n);
    static const struct {
        size_t at;
        uint32_t value;
    } change[] = {{0, 0x20202020},
                  {4, 0},
                  {4, 2},
                  {4, 0xffffffff},
                  {8, 0xffffffff},
                  {8, 1},
                  {12, 5},
                  {12, 0x27},
                  {12, 0xffffffff},
                  {HEADER, 0},
                  {HEADER, 2},
                  {HEADER + 2, 0x7fc00000},
                  {HEADER + 2, 0x7f800000},
                  {HEADER + 26, 0xff800000}};
    for (size_t i = 0; i < sizeof change / sizeof change[0]; i++) {
        memcpy(data, golden, sizeof golden);
        if (change[i].at == HEADER)
            data[HEADER] = (unsigned char)change[i].value;
        else
            put_u32(data + change[i].at, change[i].value);
        expect_damaged(state, data, sizeof golden);
    }
    memcpy(data, golden, sizeof golden);
    data[sizeof golden] = 0;
    expect_damaged(state, data, sizeof golden + 1);
    assert_int_equal(fiber_set_read_hair(&f, scratch_path(state, "absent.hair"), &err), STATUS_NOT_FOUND);
}

/* After any change of one byte, reading either fails or gives a valid set. */
static void test_every_changed_byte(void **state)
{
    unsigned char data[sizeof golden];
    const char *path = scratch_path(state, "changed.hair");
    for (size_t i = 0; i < sizeof golden; i++)
        for (unsigned v = 0; v < 256; v += 51) {
            struct fiber_set f;
            fiber_set_init(&f);
            memcpy(data, golden, sizeof golden);
            data[i] = (unsigned char)v;
            scratch_write(path, data, sizeof data);
            if (fiber_set_read_hair(&f, path, NULL) == STATUS_OK) {
                if (f.tile_size_m[0] == 0.0) f.tile_size_m[0] = f.tile_size_m[1] = 1e-3;
                assert_int_equal(fiber_set_validate(&f, NULL), STATUS_OK);
            }
            fiber_set_release(&f);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_golden_bytes),
        cmocka_unit_test(test_round_trip_of_many),
        cmocka_unit_test(test_groups_round_trip),
        cmocka_unit_test(test_longest_fiber),
        cmocka_unit_test(test_files_of_other_programs),
        cmocka_unit_test(test_no_thickness_is_an_error),
        cmocka_unit_test(test_damaged_files),
        cmocka_unit_test(test_every_changed_byte),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
