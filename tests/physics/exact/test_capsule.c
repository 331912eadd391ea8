/* The parts of the cloth by definition (tests/exact): intervals of lines in segments against balls along their axes,
 * and which fibers are one tube.
 */
#include "tests/exact/capsule_cloth.h"

#include "base/rng.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* Least distance of a point from the surfaces of many balls along the axis; negative inside of one. */
static double by_balls(const struct capsule *c, const double x[3])
{
    enum { N = 4000 };
    double least = INFINITY;
    for (int i = 0; i <= N; i++) {
        const double u = (double)i / N;
        double away2 = 0.0;
        for (int k = 0; k < 3; k++) {
            const double y = x[k] - c->a[k] - u * (c->b[k] - c->a[k]);
            away2 += y * y;
        }
        least = fmin(least, sqrt(away2) - c->radius[0] - u * (c->radius[1] - c->radius[0]));
    }
    return least;
}

static double uniform(struct rng *r, double low, double high) { return low + (high - low) * rng_double(r); }

static void lines_are_cut_where_balls_say(void **state)
{
    (void)state;
    struct rng r;
    int n_met = 0;
    rng_start(&r, &(struct rng_key){.seed = 5}, 0, 0);
    for (int i = 0; i < 2000; i++) {
        struct capsule c = {.radius = {uniform(&r, 0.1, 1.0), uniform(&r, 0.1, 1.0)}};
        double o[3], d[3], t[2], length2 = 0.0, normal[3], radius;
        if (i % 3 == 0) c.radius[1] = c.radius[0];
        for (int k = 0; k < 3; k++) {
            c.a[k] = uniform(&r, -1.0, 1.0);
            c.b[k] = uniform(&r, -1.0, 1.0);
            o[k] = uniform(&r, -4.0, 4.0);
            d[k] = uniform(&r, -1.0, 1.0) - o[k];
            if (i % 7 == 0) d[k] = c.b[k] - c.a[k]; /* along the axis */
            length2 += d[k] * d[k];
        }
        for (int k = 0; k < 3; k++) d[k] /= sqrt(length2);
        capsule_finish(&c);
        const bool met = capsule_interval(&c, o, d, t);
        for (int j = 0; j < 40; j++) {
            const double at = uniform(&r, 0.0, 9.0), x[3] = {o[0] + at * d[0], o[1] + at * d[1], o[2] + at * d[2]};
            const double truth = by_balls(&c, x), own = capsule_distance(&c, x, normal, &radius);
            /* inside, the nearest surface of all balls together is farther than that of any one */
            if (truth > 0.0) assert_float_equal(own, truth, 1e-3);
            if (truth > 1e-3) assert_false(met && at > t[0] && at < t[1]);
            if (truth < -1e-9) assert_true(met && at > t[0] && at < t[1]);
        }
        if (!met) continue;
        n_met++;
        for (int k = 0; k < 2; k++) {
            const double x[3] = {o[0] + t[k] * d[0], o[1] + t[k] * d[1], o[2] + t[k] * d[2]};
            assert_float_equal(capsule_distance(&c, x, normal, &radius), 0.0, 1e-9);
            assert_true((normal[0] * d[0] + normal[1] * d[1] + normal[2] * d[2] < 1e-9) == (k == 0));
        }
    }
    assert_in_range(n_met, 500, 1900);
}

/* Three fibers of a tile of 2 x 1: the first goes on as the second in the next tile, the second as the first, and the
 * third as itself. */
static void fibers_go_on_in_others(void **state)
{
    (void)state;
    struct fiber_set f;
    struct tube_links l;
    fiber_set_init(&f);
    assert_int_equal(fiber_set_reserve(&f, 3, 6, NULL), STATUS_OK);
    const float at[18] = {0, 0.2f, 0, 2, 0.4f, 0, 0, 0.4f, 0, 2, 0.2f, 0, 1, 0, 0.5f, 1, 1, 0.5f};
    memcpy(f.position_m, at, sizeof at);
    for (size_t i = 0; i < 3; i++) f.radius_m[i] = 0.05f;
    for (size_t i = 0; i < 4; i++) f.first_vertex[i] = 2 * i;
    f.tile_size_m[0] = 2.0;
    f.tile_size_m[1] = 1.0;
    assert_true(tube_links_find(&l, &f));
    const struct tube first = tube_of(&l, 0, (const int[2]){0, 0}), second = tube_of(&l, 1, (const int[2]){1, 0}),
                      again = tube_of(&l, 0, (const int[2]){-4, 0}), other = tube_of(&l, 0, (const int[2]){1, 0}),
                      beside = tube_of(&l, 1, (const int[2]){1, 1}), third = tube_of(&l, 2, (const int[2]){0, 0}),
                      third_on = tube_of(&l, 2, (const int[2]){0, 5}),
                      third_beside = tube_of(&l, 2, (const int[2]){1, 0});
    assert_memory_equal(&first, &second, sizeof first);
    assert_memory_equal(&first, &again, sizeof first);
    assert_memory_not_equal(&first, &other, sizeof first);
    assert_memory_not_equal(&second, &beside, sizeof first);
    assert_memory_equal(&third, &third_on, sizeof first);
    assert_memory_not_equal(&third, &third_beside, sizeof first);
    tube_links_release(&l);
    fiber_set_release(&f);
}

/* Two overlapping fibers along y and the ray across them: it enters the second where the first still is. */
static void a_tube_is_entered_inside_another(void **state)
{
    (void)state;
    struct fiber_set f;
    struct capsule_cloth c;
    struct capsule_walk *w = malloc(sizeof *w);
    struct capsule_entrance e;
    fiber_set_init(&f);
    assert_int_equal(fiber_set_reserve(&f, 2, 6, NULL), STATUS_OK);
    const float at[18] = {0.3e-3f,  0, 0, 0.3e-3f,  0.5e-3f, 0, 0.3e-3f,  1e-3f, 0,
                          0.45e-3f, 0, 0, 0.45e-3f, 0.5e-3f, 0, 0.45e-3f, 1e-3f, 0};
    memcpy(f.position_m, at, sizeof at);
    for (size_t i = 0; i < 2; i++) f.radius_m[i] = 0.1e-3f;
    for (size_t i = 0; i < 3; i++) f.first_vertex[i] = 3 * i;
    f.tile_size_m[0] = f.tile_size_m[1] = 1e-3;
    assert_non_null(w);
    assert_true(capsule_cloth_init(&c, &f, 0.0));
    const double y[3] = {0.1, 0.5, 0.999}; /* inside a segment, at a joint, and beside a face of the tile */
    for (int i = 0; i < 3; i++) {
        const double outside[3] = {0.0, y[i], 0.0}, surface[3] = {0.2, y[i], 0.0}, d[3] = {1.0, 0.0, 0.0};
        w->slack = 1e-6;
        w->n_open = w->n_part = 0;
        assert_true(capsule_walk_piece(w, &c, outside, d, 0.0, INFINITY, &e));
        assert_float_equal(e.t, 0.2, 1e-6);
        w->n_open = w->n_part = 0;
        assert_true(capsule_walk_piece(w, &c, surface, d, 0.0, INFINITY, &e));
        assert_float_equal(e.t, 0.15, 1e-6);
        assert_int_equal(c.fiber[e.i_capsule], 1);
        const double along[3] = {0.0, 1.0, 0.0}; /* through joints and tiles, and never out */
        w->n_open = w->n_part = 0;
        assert_false(capsule_walk_piece(w, &c, (const double[3]){0.3, y[i], 0.0}, along, 0.0, 50.0, &e));
    }
    capsule_cloth_release(&c);
    fiber_set_release(&f);
    free(w);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(lines_are_cut_where_balls_say),
                                       cmocka_unit_test(fibers_go_on_in_others),
                                       cmocka_unit_test(a_tube_is_entered_inside_another)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
