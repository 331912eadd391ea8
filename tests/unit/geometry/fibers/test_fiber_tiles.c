/* Large tiles of several repeats of a twill whose fibers wander: fibers go on over all cuts, their length stays, the
 * period of the small tile can no longer be told, and what shows no repeat stays as it is. */
#include "geometry/fibers/seam/fiber_seam.h"
#include "geometry/fibers/tiles/fiber_tiles.h"
#include "tests/support/cloth/make_phantom.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { BLOCKS = 4, YARNS = 8, REPEATS = YARNS / 4, CELLS = 64 };

static void make_twill(struct fiber_set *f)
{
    struct phantom_option o;
    struct phantom_report r;
    phantom_option_default(&o, PHANTOM_TWILL_2_2);
    o.n_yarn[0] = o.n_yarn[1] = YARNS;
    o.n_fiber_per_yarn = 19;
    o.migration = 0.3;
    o.radius_spread = 0.1;
    o.seed = 5;
    make_phantom(&o, 0, f, &r);
}

/* Length of fibers times their height in each cell of n_tile x n_tile small tiles, from above. */
static void look_down(const struct fiber_set *f, const double small_m[2], size_t n_tile, double *map)
{
    const size_t n = n_tile * CELLS;
    memset(map, 0, n * n * sizeof *map);
    for (size_t i = 0; i < f->n_fiber; i++)
        for (size_t k = f->first_vertex[i]; k + 1 < f->first_vertex[i + 1]; k++) {
            const float *p = f->position_m + 3 * k, *q = p + 3;
            const double length = hypot(hypot(q[0] - p[0], q[1] - p[1]), q[2] - p[2]);
            size_t at[2];
            for (int a = 0; a < 2; a++) {
                const double x = 0.5 * ((double)p[a] + (double)q[a]) / small_m[a] * CELLS;
                at[a] = (size_t)((((long)floor(x) % (long)n) + (long)n) % (long)n);
            }
            map[at[1] * n + at[0]] += length * (0.5 * ((double)p[2] + (double)q[2]) + 1e-3);
        }
}

/* Correlation of a map with itself, moved by cells. */
static double correlation(const double *map, size_t n, size_t x, size_t y)
{
    double mean = 0, square = 0, product = 0;
    for (size_t i = 0; i < n * n; i++) mean += map[i] / (double)(n * n);
    for (size_t i = 0; i < n * n; i++) {
        const double a = map[i] - mean, b = map[(i / n + y) % n * n + (i % n + x) % n] - mean;
        square += a * a;
        product += a * b;
    }
    return product / square;
}

/* By how much the correlation at the period of the small tile stands out of the one at half of it, a repeat of the
 * weave. */
static double standing_out(const double *map, size_t n)
{
    return correlation(map, n, CELLS, 0) - correlation(map, n, CELLS / REPEATS, 0);
}

/* Ends of fibers that do not lie on a face. */
static size_t ends_inside(const struct fiber_set *f)
{
    size_t n = 0;
    for (size_t i = 0; i < 2 * f->n_fiber; i++) {
        const float *p = f->position_m + 3 * (i % 2 == 0 ? f->first_vertex[i / 2] : f->first_vertex[i / 2 + 1] - 1);
        bool on_face = false;
        for (int a = 0; a < 2; a++)
            on_face |= fabs((double)p[a]) < 1e-7 || fabs((double)p[a] - f->tile_size_m[a]) < 1e-7;
        n += !on_face;
    }
    return n;
}

static void fibers_go_on_without_a_period(void **state)
{
    (void)state;
    struct fiber_set f, small;
    struct fiber_tiles tiles;
    struct fiber_seam seam;
    struct error err = {0};
    const size_t n = BLOCKS * CELLS;
    double *map = malloc(n * n * sizeof *map), small_m[2];
    fiber_set_init(&small);
    make_twill(&f);
    memcpy(small_m, f.tile_size_m, sizeof small_m);
    assert_int_equal(fiber_set_copy(&f, &small, &err), STATUS_OK);
    const double length = fiber_set_length_m(&f);
    look_down(&f, small_m, 1, map);
    const double before = standing_out(map, CELLS);
    if (fiber_tiles_make(&f, BLOCKS, 7, &tiles, &err) != STATUS_OK) fail_msg("%s", err.text);
    if (fiber_set_validate(&f, &err) != STATUS_OK) fail_msg("%s", err.text);
    look_down(&f, small_m, BLOCKS, map);
    const double after = standing_out(map, n), longer = fiber_set_length_m(&f) / (BLOCKS * BLOCKS * length);
    const size_t inside = ends_inside(&f);
    assert_int_equal(fiber_seam_measure(&f, &seam, &err), STATUS_OK);
    print_message("moves %zu, cut ends %zu, free %zu, moved by %.2f radii; ends inside %zu (small tile %zu); length "
                  "%.4f; period stands out by %.3f, before %.3f; seams %.3f %.3f\n",
                  tiles.n_move, tiles.n_cut_end, tiles.n_free, tiles.move_m / (double)small.radius_m[0], inside,
                  ends_inside(&small), longer, after, before, seam.share[0], seam.share[1]);
    assert_true(tiles.n_move >= REPEATS * REPEATS);
    assert_true(tiles.n_cut_end > 1000 && tiles.n_free * 100 <= tiles.n_cut_end);
    assert_true(fabs(longer - 1) < 0.02 && after < 0.1 * before);
    assert_true(seam.share[0] > 0.96 && seam.share[1] > 0.96);
    assert_true(fabs(f.tile_size_m[0] - BLOCKS * small_m[0]) < 1e-12);
    fiber_set_release(&f), fiber_set_release(&small);
    free(map);
}

static void felt_stays_as_it_is(void **state)
{
    (void)state;
    struct phantom_option o;
    struct phantom_report r;
    struct fiber_set f;
    struct fiber_tiles tiles;
    struct error err = {0};
    phantom_option_default(&o, PHANTOM_FELT);
    make_phantom(&o, 0, &f, &r);
    const size_t n_vertex = f.n_vertex;
    assert_int_equal(fiber_tiles_make(&f, 3, 7, &tiles, &err), STATUS_OK);
    assert_true(tiles.n_move == 1 && f.n_vertex == n_vertex);
    assert_int_equal(fiber_tiles_make(&f, FIBER_TILES_MAX + 1, 7, &tiles, &err), STATUS_TOO_LARGE);
    fiber_set_release(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(fibers_go_on_without_a_period),
        cmocka_unit_test(felt_stays_as_it_is),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
