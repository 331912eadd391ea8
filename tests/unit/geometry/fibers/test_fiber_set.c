/* Fiber sets in memory and as text. */
#include "geometry/fibers/fiber_set.h"
#include "tests/support/scratch_folder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* Two fibers: along x with 3 vertices, along z with 2. */
static struct fiber_set two_fibers(void)
{
    static const float position[] = {0, 1e-4f, 0, 1e-4f, 1e-4f, 0, 3e-4f, 1e-4f, 1e-5f, 2e-4f, 0, 0, 2e-4f, 0, 1e-4f};
    struct fiber_set f;
    fiber_set_init(&f);
    f.tile_size_m[0] = f.tile_size_m[1] = 3e-4;
    assert_int_equal(fiber_set_reserve(&f, 2, 5, NULL), STATUS_OK);
    f.first_vertex[1] = 3;
    f.first_vertex[2] = 5;
    memcpy(f.position_m, position, sizeof position);
    f.radius_m[0] = 5e-6f;
    f.radius_m[1] = 7e-6f;
    fiber_set_classify(&f);
    return f;
}

static void test_measures(void **state)
{
    (void)state;
    struct fiber_set f = two_fibers();
    double low, high;
    assert_int_equal(fiber_set_validate(&f, NULL), STATUS_OK);
    assert_true(fabs(fiber_set_length_m(&f) - (1e-4 + hypot(2e-4, 1e-5) + 1e-4)) < 1e-10);
    fiber_set_z_range_m(&f, &low, &high);
    assert_true(fabs(low + 7e-6) < 1e-11 && fabs(high - 1.07e-4) < 1e-10);
    assert_int_equal(f.axis_class[0], 0);
    assert_int_equal(f.axis_class[1], 2);
    fiber_set_release(&f);
    fiber_set_release(&f); /* a second call is allowed */
    fiber_set_release(NULL);
}

static void expect_invalid(struct fiber_set *f, const char *text)
{
    struct error err = {0};
    assert_int_equal(fiber_set_validate(f, &err), STATUS_INVALID);
    if (strstr(err.text, text) == NULL) fail_msg("'%s' does not say '%s'", err.text, text);
}

static void test_validation_names_the_fiber(void **state)
{
    (void)state;
    struct fiber_set f = two_fibers(), empty;
    fiber_set_init(&empty);
    expect_invalid(&empty, "no fiber");
    const float bad[] = {NAN, INFINITY, 0.0f, -1.0f};
    for (size_t i = 0; i < 4; i++) {
        f.radius_m[1] = bad[i];
        expect_invalid(&f, "fiber 1 has radius");
        f.radius_m[1] = 7e-6f;
        f.tile_size_m[1] = (double)bad[i];
        expect_invalid(&f, "tile size in y");
        f.tile_size_m[1] = 3e-4;
        f.position_m[10] = bad[i];
        if (i < 2) expect_invalid(&f, "vertex 0 of fiber 1");
        f.position_m[10] = 0.0f;
    }
    f.first_vertex[1] = 4;
    expect_invalid(&f, "fiber 1 has fewer than two");
    f.first_vertex[1] = 6;
    expect_invalid(&f, "fiber 0 has fewer than two");
    f.first_vertex[1] = 3;
    f.first_vertex[2] = 4;
    expect_invalid(&f, "vertices");
    f.first_vertex[2] = 5;
    f.axis_class[0] = 3;
    expect_invalid(&f, "axis class");
    f.axis_class[0] = 0;
    f.group[1] = FIBER_MAX_GROUP;
    expect_invalid(&f, "fiber 1 has group 8");
    fiber_set_release(&f);
}

static void test_reserve_refuses_what_no_machine_has(void **state)
{
    (void)state;
    struct fiber_set f;
    fiber_set_init(&f);
    assert_int_equal(fiber_set_reserve(&f, SIZE_MAX / 2, 10, NULL), STATUS_NO_MEMORY);
    assert_int_equal(fiber_set_reserve(&f, 10, SIZE_MAX / 4, NULL), STATUS_NO_MEMORY);
    assert_int_equal(f.n_fiber, 0);
    fiber_set_release(&f);
}

static void test_text_round_trip(void **state)
{
    const char *path = scratch_path(state, "fibers.txt");
    struct fiber_set f = two_fibers(), g;
    fiber_set_init(&g);
    assert_int_equal(fiber_set_write_text(&f, path, NULL), STATUS_OK);
    assert_int_equal(fiber_set_read_text(&g, path, NULL), STATUS_OK);
    assert_int_equal(g.n_fiber, 2);
    assert_int_equal(g.n_vertex, 5);
    assert_memory_equal(g.first_vertex, f.first_vertex, 3 * sizeof *f.first_vertex);
    assert_memory_equal(g.axis_class, f.axis_class, 2);
    assert_memory_equal(g.group, f.group, 2);
    for (size_t i = 0; i < 15; i++)
        assert_true(fabsf(g.position_m[i] - f.position_m[i]) <= 1e-7f * fabsf(f.position_m[i]));
    assert_true(fabsf(g.radius_m[1] - 7e-6f) < 1e-12f);
    assert_true(g.tile_size_m[0] == 0.0 && g.tile_size_m[1] == 0.0);
    fiber_set_release(&f);
    fiber_set_release(&g);
}

static void test_text_keeps_groups(void **state)
{
    float p[4];
    int n_read = 0;
    const char *path = scratch_path(state, "groups.txt");
    struct fiber_set f = two_fibers(), g;
    size_t n;
    fiber_set_init(&g);
    assert_int_equal(fiber_set_n_group(&f), 1);
    assert_int_equal(fiber_set_write_text(&f, path, NULL), STATUS_OK);
    char *text = scratch_read(path, &n); /* without groups there is no fifth column */
    assert_int_equal(sscanf(text, "%f %f %f %f%n", &p[0], &p[1], &p[2], &p[3], &n_read), 4);
    assert_int_equal(text[n_read], '\n');
    free(text);
    f.group[1] = 6;
    assert_int_equal(fiber_set_n_group(&f), 7);
    assert_int_equal(fiber_set_write_text(&f, path, NULL), STATUS_OK);
    assert_int_equal(fiber_set_read_text(&g, path, NULL), STATUS_OK);
    assert_memory_equal(g.first_vertex, f.first_vertex, 3 * sizeof *f.first_vertex);
    assert_memory_equal(g.group, f.group, 2);
    fiber_set_release(&f);
    fiber_set_release(&g);
}

static status read_text(void **state, const char *text, size_t n, struct fiber_set *f, struct error *err)
{
    const char *path = scratch_path(state, "given.txt");
    scratch_write(path, text, n);
    return fiber_set_read_text(f, path, err);
}

static void test_text_of_other_programs(void **state)
{
    static const char text[] = "\n  \n 1 2 3 0.5 \r\n+1.5\t2 3e0 1.5\r\n\r\n\n0 0 0 1\n0 0 1 1";
    struct fiber_set f;
    fiber_set_init(&f);
    assert_int_equal(read_text(state, text, sizeof text - 1, &f, NULL), STATUS_OK);
    assert_int_equal(f.n_fiber, 2);
    assert_int_equal(f.first_vertex[1], 2);
    assert_true(fabsf(f.position_m[3] - 1.5e-3f) < 1e-9f);
    assert_true(fabsf(f.radius_m[0] - 1e-3f) < 1e-9f); /* the mean of its points */
    fiber_set_release(&f);
}

/* A comment does not end a fiber; a byte order mark is no number. */
static void test_comments_of_text(void **state)
{
    static const char text[] =
        "\xef\xbb\xbf# x y z radius\n0 0 0 1\n  # between\r\n0 0 1 1 # 3\n\n#\n0 0 0 2#\n0 0 1 2\n# the end";
    struct fiber_set f;
    struct error err = {0};
    fiber_set_init(&f);
    if (read_text(state, text, sizeof text - 1, &f, &err) != STATUS_OK) fail_msg("%s", err.text);
    assert_int_equal(f.n_fiber, 2);
    assert_int_equal(f.n_vertex, 4);
    assert_true(fabsf(f.radius_m[1] - 2e-3f) < 1e-9f);
    fiber_set_release(&f);
}

static void test_text_errors_name_the_line(void **state)
{
    static const struct {
        const char *text, *says;
    } bad[] = {
        {"", "no fiber"},
        {"\n\n", "no fiber"},
        {"0 0 0 1\n\n0 0 0 1\n0 0 1 1\n", "line 2"},
        {"0 0 0 1\n0 0 1\n", "line 2"},
        {"0 0 0 1\n0 0 1\n5\n", "line 2"}, /* must not read on in the next line */
        {"0 0 0 1\n0 0 1 1 1\n", "line 2 has another group"},
        {"0 0 0 1 1\n0 0 1 1 2\n", "line 2 has another group"},
        {"0 0 0 1 2\n0 0 1 1 2 2\n", "line 2"},
        {"0 0 0 1 2\n0 0 1 1 8\n", "line 2"},
        {"0 0 0 1 -1\n0 0 1 1 -1\n", "line 1"},
        {"0 0 0 1 0.5\n0 0 1 1 0.5\n", "line 1"},
        {"0 0 0 1 nan\n0 0 1 1 nan\n", "line 1"},
        {"0 0 0 1\n0 nan 1 1\n", "line 2"},
        {"0 0 0 1\n0 0 1 inf\n", "line 2"},
        {"0 0 0 1\n0 0 1 0\n", "line 2"},
        {"0 0 0 1\n0 0 1 -1\n", "line 2"},
        {"# comment\n0 0 0 x\n0 0 1 1\n", "line 2"},
        {"0 0 0 1\n0 0 1e999 1\n", "line 2"},
    };
    struct fiber_set f = two_fibers();
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct error err = {0};
        assert_int_equal(read_text(state, bad[i].text, strlen(bad[i].text), &f, &err), STATUS_FORMAT);
        if (strstr(err.text, bad[i].says) == NULL) fail_msg("%zu: '%s' does not say '%s'", i, err.text, bad[i].says);
        if (strchr(err.text, '/') != NULL) fail_msg("%zu: '%s' names a folder", i, err.text);
        assert_int_equal(f.n_fiber, 2); /* left as it was */
    }
    struct error err;
    char longer[1000];
    memset(longer, '1', sizeof longer);
    assert_int_equal(read_text(state, longer, sizeof longer, &f, &err), STATUS_FORMAT);
    assert_int_equal(read_text(state, "0 0 0 1\n0 0\0 1 1\n", 17, &f, &err), STATUS_FORMAT);
    assert_int_equal(fiber_set_read_text(&f, scratch_path(state, "absent.txt"), &err), STATUS_NOT_FOUND);
    fiber_set_release(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_measures),
        cmocka_unit_test(test_validation_names_the_fiber),
        cmocka_unit_test(test_reserve_refuses_what_no_machine_has),
        cmocka_unit_test(test_text_round_trip),
        cmocka_unit_test(test_text_keeps_groups),
        cmocka_unit_test(test_text_of_other_programs),
        cmocka_unit_test(test_comments_of_text),
        cmocka_unit_test(test_text_errors_name_the_line),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
