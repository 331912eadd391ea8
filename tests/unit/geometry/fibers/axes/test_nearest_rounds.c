/* Fits of lines at rest, which keep the nearest segments of voxels for some rounds: the result does not depend on how
 * many of them there is room for, and is the result of fits that find them anew. */
#include "geometry/fibers/axes/axis_fit.h"
#include "geometry/fibers/axes/model/nearest_cache.h"
#include "geometry/fibers/axes/model/nearest_rounds.h"
#include "tests/support/scratch_folder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

enum { NX = 96, NY = 72, NZ = 72, N_ROW = 5, N_FIBER = N_ROW * N_ROW, N_ROUND = 6, LEAST_LIMIT = 1 << 20 };
static const size_t N[3] = {NX, NY, NZ};
static const double RADIUS = 4.0, BLUR = 0.7, SPACING = 13.0;

static void middle_of(size_t i_fiber, double x, double at[2])
{
    at[0] = 9.0 + SPACING * (double)(i_fiber % N_ROW) + 2.0 * sin(0.05 * x);
    at[1] = 9.0 + SPACING * (double)(i_fiber / N_ROW) + 2.0 * cos(0.05 * x);
}

/* Fibers that wind along x, and lines beside their axes. */
static void make_scan(struct volume *v, struct polyline_set *lines)
{
    const double voxel_size_m[3] = {2e-6, 2e-6, 2e-6};
    assert_int_equal(volume_init(v, N, voxel_size_m, NULL), STATUS_OK);
    polyline_set_init(lines);
    for (size_t f = 0; f < N_FIBER; f++) {
        assert_int_equal(polyline_begin(lines, 0, NULL), STATUS_OK);
        for (size_t i = 0; i < NX; i++) {
            const double x = (double)i + 0.5;
            double at[2];
            middle_of(f, x, at);
            const float vertex[3] = {(float)x, (float)(at[0] + 0.4 * sin(0.3 * x + (double)f)),
                                     (float)(at[1] + 0.3 * cos(0.2 * x))};
            assert_int_equal(polyline_add(lines, vertex, NULL), STATUS_OK);
            for (size_t k = 0; k < NZ; k++)
                for (size_t j = 0; j < NY; j++) {
                    const double d = hypot((double)j + 0.5 - at[0], (double)k + 0.5 - at[1]) - RADIUS;
                    v->density[volume_index(N, i, j, k)] += (float)(0.5 * erfc(d / (M_SQRT2 * BLUR)));
                }
        }
    }
}

static void fit(const struct polyline_set *from, const struct volume *v, bool at_rest, struct polyline_set *to)
{
    struct axis_profile profile = {
        .radius = RADIUS, .radius_spread = 0.1, .blur = BLUR, .high = 1.0, .independent = 1.0, .at_rest = at_rest};
    polyline_set_init(to);
    for (size_t l = 0; l < from->n_line; l++)
        assert_int_equal(polyline_add_part(to, from, l, from->first[l], from->first[l + 1], NULL), STATUS_OK);
    assert_int_equal(polylines_fit(to, v, 2.0 * RADIUS, N_ROUND, &profile, NULL, NULL, NULL), STATUS_OK);
}

/* Root of the mean square of the distances between the lines and the axes, or between the lines and others. */
static double distance_of(const struct polyline_set *lines, const struct polyline_set *other)
{
    double square = 0.0;
    for (size_t i = 0; i < lines->n_vertex; i++) {
        double at[2];
        middle_of(i / NX, (double)lines->vertex[i][0], at);
        for (int a = 0; a < 2; a++) {
            const double d =
                (double)lines->vertex[i][1 + a] - (other == NULL ? at[a] : (double)other->vertex[i][1 + a]);
            square += d * d / (double)lines->n_vertex;
        }
    }
    return sqrt(square);
}

/* The nearest segments take some 400 kB, and the least scratch space has room for an eighth of a megabyte of them. */
static void test_room_for_lists(void **state)
{
    struct volume v;
    struct polyline_set lines, all, few;
    struct scratch_space *space = NULL;
    make_scan(&v, &lines);
    fit(&lines, &v, true, &all);
    assert_int_equal(scratch_space_new(*state, LEAST_LIMIT, &space, NULL), STATUS_OK);
    v.space = space;
    fit(&lines, &v, true, &few);
    v.space = NULL;
    assert_memory_equal(all.vertex, few.vertex, all.n_vertex * sizeof *all.vertex);
    assert_memory_equal(all.radius, few.radius, all.n_line * sizeof *all.radius);
    scratch_space_free(space);
    volume_release(&v);
    polyline_set_release(&lines);
    polyline_set_release(&all);
    polyline_set_release(&few);
}

/* The scan has no noise, so that both fits end at the axes: the lines begin 0.35 voxels beside them. */
static void test_same_axes(void **state)
{
    (void)state;
    struct volume v;
    struct polyline_set lines, kept, anew;
    make_scan(&v, &lines);
    fit(&lines, &v, true, &kept);
    fit(&lines, &v, false, &anew);
    const double begin = distance_of(&lines, NULL), left = distance_of(&anew, NULL),
                 with_kept = distance_of(&kept, NULL), apart = distance_of(&kept, &anew);
    print_message("voxels from the axes: %.4f at the beginning, %.4f found anew, %.4f kept, %.5f apart\n", begin, left,
                  with_kept, apart);
    assert_true(left < 0.01 * begin);
    assert_true(with_kept < 0.01 * begin);
    assert_true(apart < 0.01 * begin);
    assert_true(memcmp(kept.vertex, anew.vertex, kept.n_vertex * sizeof *kept.vertex) != 0); /* they were kept */
    volume_release(&v);
    polyline_set_release(&lines);
    polyline_set_release(&kept);
    polyline_set_release(&anew);
}

/* A brick whose list does not fit is not kept, and does not take the room of the next one. */
static void test_store(void **state)
{
    (void)state;
    const uint16_t cell[20 + LANES] = {7, 8, 9};
    const uint32_t small_first[3] = {0, 1, 3}, large_first[3] = {0, 1, 20};
    const struct nearest_list small = {cell, small_first}, large = {cell, large_first};
    struct nearest_list found;
    struct nearest_cache s;
    assert_true(nearest_cache_init(&s, 3, (3 + LANES) * sizeof *cell + sizeof small_first));
    nearest_cache_add(&s, 0, &large, 2);
    nearest_cache_add(&s, 1, &small, 2);
    nearest_cache_add(&s, 2, &small, 2);
    assert_false(nearest_cache_find(&s, 0, &found));
    assert_false(nearest_cache_find(&s, 2, &found));
    assert_true(nearest_cache_find(&s, 1, &found));
    assert_memory_equal(found.cell, cell, (3 + LANES) * sizeof *cell);
    assert_memory_equal(found.first, small_first, sizeof small_first);
    nearest_cache_release(&s);
    nearest_cache_release(&s); /* an empty store */
}

/* Makes a step that moves all vertices by d voxels, and returns the kind of the round after it. */
static struct round_kind after_step(struct nearest_rounds *r, struct polyline_set *lines, float d, bool is_last)
{
    nearest_rounds_before_step(r, lines);
    for (size_t i = 0; i < lines->n_vertex; i++) lines->vertex[i][1] += d;
    nearest_rounds_after_step(r, lines);
    return nearest_rounds_next(r, is_last);
}

/* Nearest segments serve three rounds and are found anew after a step of more than a tenth of a voxel. The last round
 * stores none. */
static void test_rounds(void **state)
{
    (void)state;
    static const float vertex[2][3] = {{1, 2, 3}, {2, 2, 3}};
    struct nearest_rounds r = {0};
    struct polyline_set lines;
    polyline_set_init(&lines);
    assert_int_equal(polyline_begin(&lines, 0, NULL), STATUS_OK);
    for (int i = 0; i < 2; i++) assert_int_equal(polyline_add(&lines, vertex[i], NULL), STATUS_OK);
    struct round_kind k = nearest_rounds_next(&r, false); /* not of lines at rest */
    assert_false(k.follows || k.is_followed);
    assert_true(nearest_rounds_start(&r, lines.n_vertex));
    k = nearest_rounds_next(&r, false);
    assert_true(!k.follows && k.is_followed);
    for (int i = 0; i < 2; i++) assert_true(after_step(&r, &lines, 0.05f, false).follows);
    k = after_step(&r, &lines, 0.05f, false);
    assert_true(!k.follows && k.is_followed);
    k = after_step(&r, &lines, 0.2f, false);
    assert_true(!k.follows && k.is_followed);
    assert_true(after_step(&r, &lines, 0.05f, true).follows);
    k = after_step(&r, &lines, 0.2f, true);
    assert_false(k.follows || k.is_followed);
    nearest_rounds_release(&r);
    polyline_set_release(&lines);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_room_for_lists, scratch_folder_setup, scratch_folder_teardown),
        cmocka_unit_test(test_same_axes), cmocka_unit_test(test_rounds), cmocka_unit_test(test_store)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
