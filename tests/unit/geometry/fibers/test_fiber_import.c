/* Fibers of other programs: the kind of a file is found by its content, its radius comes from the file or from the job,
 * and its other statements are listed. */
#include "base/option_id.h"
#include "geometry/fibers/fiber_import.h"
#include "tests/support/scratch_folder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const float INF = INFINITY;

struct bytes {
    uint8_t data[512];
    size_t n;
};

static void put(struct bytes *b, const void *data, size_t n)
{
    memcpy(b->data + b->n, data, n);
    b->n += n;
}

/* Mitsuba's binary hair of so many numbers; the test runs on little-endian machines only. */
static struct bytes mitsuba(uint32_t n_vertex, const float *number, size_t n_number)
{
    struct bytes b = {.n = 0};
    put(&b, "BINARY_HAIR", 11);
    put(&b, &n_vertex, sizeof n_vertex);
    put(&b, number, n_number * sizeof *number);
    return b;
}

static status import(void **state, const struct bytes *b, const char *name, double radius_m, struct fiber_set *f,
                     struct error *err)
{
    const char *path = scratch_path(state, name);
    scratch_write(path, b->data, b->n);
    return fiber_import(f, path, &(struct fiber_file_terms){.radius_m = radius_m}, err);
}

/* A fiber of three points and one of two, with a mark before the first one and without. */
static void binary_hair_of_mitsuba_is_read(void **state)
{
    const float number[] = {INF, 0, 0, 1, 0, 1, 1, 0, 2, 1, INF, 5, 0, 1, 6, 0, 1};
    for (size_t skip = 0; skip < 2; skip++) {
        struct fiber_set f;
        struct error err = {0};
        fiber_set_init(&f);
        const struct bytes b = mitsuba(5, number + skip, sizeof number / sizeof *number - skip);
        if (import(state, &b, "m.hair", 4e-6, &f, &err) != STATUS_OK) fail_msg("%s", err.text);
        assert_int_equal(f.n_fiber, 2);
        assert_int_equal(f.first_vertex[1], 3);
        assert_int_equal(f.first_vertex[2], 5);
        assert_true(f.radius_m[0] == 4e-6f && f.radius_m[1] == 4e-6f);
        assert_true(fabsf(f.position_m[9] - 5e-3f) < 1e-9f);
        assert_int_equal(f.axis_class[0], 1);
        fiber_set_release(&f);
    }
}

static void damaged_binary_hair_is_refused(void **state)
{
    static const struct {
        uint32_t n_vertex;
        float number[12];
        size_t n_number;
        const char *says;
    } bad[] = {
        {2, {0}, 0, "not the length of 2 points"},
        {0xffffffff, {INF, 0, 0, 0, 0, 0, 1}, 7, "not the length"},
        {1, {INF, 0, 0, 0, 0, 0, 1}, 7, "not the length"},
        {0, {0}, 0, "no fiber"},
        {2, {INF, 0, 0, 0, INF, 1, 1, 1}, 8, "one point only"},
        {2, {INF, INF, 0, 0, 0, 0, 0, 1}, 8, "not a finite point"},
        {2, {0, 0, NAN, 0, 0, 1}, 6, "point 0 is not a finite point"},
        {2, {0, 0, 0, 0, INF, 1}, 6, "point 1 is not a finite point"},
        {2, {0, 0, 0, 0, 0, 1, 7}, 7, "states 2 points"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct fiber_set f;
        struct error err = {0};
        fiber_set_init(&f);
        const struct bytes b = mitsuba(bad[i].n_vertex, bad[i].number, bad[i].n_number);
        assert_int_equal(import(state, &b, "m.hair", 4e-6, &f, &err), STATUS_FORMAT);
        if (strstr(err.text, bad[i].says) == NULL) fail_msg("%zu: '%s' does not say '%s'", i, err.text, bad[i].says);
        fiber_set_release(&f);
    }
}

/* Files with and without a radius, and the same with a radius of the job: exactly one must state it. */
static void a_radius_is_stated_once(void **state)
{
    const float number[] = {INF, 0, 0, 1, 0, 1, 1};
    struct bytes file[4] = {mitsuba(2, number, 7)};
    put(&file[1], "0 0 1\n0 1 1\n", 12);
    put(&file[2], "0 0 1 .004\n0 1 1 .004\n", 22);
    put(&file[3], "0 0 1 .004 1\n0 1 1 .004 1\n", 26);
    for (size_t i = 0; i < 4; i++)
        for (int given = 0; given < 2; given++) {
            struct fiber_set f;
            struct error err = {0};
            fiber_set_init(&f);
            const bool right = given == (i < 2);
            const status s = import(state, &file[i], i == 1 ? "m.hair" : "m.txt", given ? 4e-6 : NAN, &f, &err);
            assert_int_equal(s, right ? STATUS_OK : STATUS_INVALID);
            if (right) assert_true(fabsf(f.radius_m[0] - 4e-6f) < 1e-12f);
            if (!right) assert_string_equal(err.field, OPTION_FIBER_RADIUS);
            if (!right) assert_non_null(strstr(err.text, given ? "leave it out" : "states no radius"));
            fiber_set_release(&f);
        }
}

/* Yuksel's file of one strand: flags, thickness and transparency of the header, its color, arrays after it. */
static struct bytes yuksel(uint32_t flags, float thickness, float transparency, float red)
{
    struct bytes b = {.n = 0};
    const uint32_t count[4] = {1, 2, flags, 1};
    const float standard[5] = {thickness, transparency, red, 1, 1};
    const float point[6] = {0, 0, 1, 0, 1, 1}, more[8] = {0.5f, 0.5f, 0.5f, 0.5f, 0.5f, 0.5f, 0.5f, 0.5f};
    put(&b, "HAIR", 4);
    put(&b, count, sizeof count);
    put(&b, standard, sizeof standard);
    b.n = 128;
    put(&b, point, sizeof point);
    put(&b, more, ((flags & 8) != 0 ? 8u : 0u) + ((flags & 16) != 0 ? 24u : 0u));
    return b;
}

static void unused_statements_of_hair_are_listed(void **state)
{
    static const struct {
        uint32_t flags;
        float transparency, red;
        const char *listed[2];
    } of[] = {
        {2, 0, 1, {NULL, NULL}},
        {2 | 8, 0, 1, {"of each point", NULL}},
        {2 | 16, 0, 1, {NULL, "of each point"}},
        {2 | 8 | 16, 0.5f, 0, {"of each point", "of each point"}},
        {2, 0.25f, 0, {"0.25", "0 1 1"}},
    };
    static const char *const name[2] = {"transparency", "colors"};
    for (size_t i = 0; i < sizeof of / sizeof *of; i++) {
        const char *path = scratch_path(state, "y.hair");
        const struct bytes b = yuksel(of[i].flags, 0.01f, of[i].transparency, of[i].red);
        struct file_ledger ledger = {0};
        struct fiber_set f;
        struct error err = {0};
        fiber_set_init(&f);
        scratch_write(path, b.data, b.n);
        const struct fiber_file_terms terms = {.radius_m = NAN, .ledger = &ledger};
        if (fiber_import(&f, path, &terms, &err) != STATUS_OK) fail_msg("%zu: %s", i, err.text);
        for (int k = 0; k < 2; k++) {
            const struct file_statement *found = file_ledger_find(&ledger, name[k]);
            if ((found == NULL) != (of[i].listed[k] == NULL)) fail_msg("%zu: %s", i, name[k]);
            if (found == NULL) continue;
            assert_string_equal(found->value, of[i].listed[k]);
            assert_int_equal(found->use, FILE_STATEMENT_NOT_USED);
        }
        fiber_set_release(&f);
    }
}

static void hair_without_thickness_takes_the_radius_of_the_job(void **state)
{
    const struct bytes b = yuksel(2, 0.0f, 0.0f, 1.0f);
    struct fiber_set f;
    struct error err = {0};
    fiber_set_init(&f);
    assert_int_equal(import(state, &b, "y.hair", 3e-6, &f, &err), STATUS_OK);
    assert_true(fabsf(f.radius_m[0] - 3e-6f) < 1e-12f);
    assert_int_equal(import(state, &b, "y.hair", NAN, &f, &err), STATUS_INVALID);
    assert_string_equal(err.field, OPTION_FIBER_RADIUS);
    fiber_set_release(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(binary_hair_of_mitsuba_is_read),
        cmocka_unit_test(damaged_binary_hair_is_refused),
        cmocka_unit_test(a_radius_is_stated_once),
        cmocka_unit_test(unused_statements_of_hair_are_listed),
        cmocka_unit_test(hair_without_thickness_takes_the_radius_of_the_job),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
