/* Rays of renderer/scene against the intervals of the cloth by definition (tests/exact), ray by ray. */
#include "renderer/scene/scene.h"
#include "renderer/scene/scene_place.h"
#include "renderer/scene/scene_ray.h"
#include "tests/exact/capsule_cloth.h"
#include "tests/support/cloth/hand_weave.h"

#include "base/rng.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { N_WALK = 4000, N_STEP = 12 };

struct both {
    struct fiber_set fibers;
    struct scene *scene;
    struct capsule_cloth cloth;
    size_t n_ray, n_hit, n_other, n_occluded, n_visited;
};

static void open_both(struct both *b)
{
    double z_low_m, z_high_m;
    struct error err = {0};
    fiber_set_z_range_m(&b->fibers, &z_low_m, &z_high_m);
    if (scene_new(&b->fibers, &(struct scene_option){0}, &b->scene, &err) != STATUS_OK) fail_msg("%s", err.text);
    assert_true(capsule_cloth_init(&b->cloth, &b->fibers, z_high_m));
}

static void close_both(struct both *b)
{
    scene_free(b->scene);
    capsule_cloth_release(&b->cloth);
    fiber_set_release(&b->fibers);
}

static void any_direction(struct rng *rng, float d[3])
{
    const double z = 2 * rng_double(rng) - 1, phi = 2 * M_PI * rng_double(rng), r = sqrt(1 - z * z);
    d[0] = (float)(r * cos(phi));
    d[1] = (float)(r * sin(phi));
    d[2] = (float)z;
}

/* The same ray by definition. from: the segment that it starts on, or NULL. */
static bool by_definition(const struct both *b, const struct scene_ray *r, const struct scene_hit *from, double *t)
{
    double o[3], d[3];
    struct capsule_walk w = {.slack = 1e-4 * b->cloth.capsule[0].radius[0]};
    struct capsule_entrance e;
    for (int k = 0; k < 3; k++) {
        o[k] = (double)(from != NULL ? from->position_mm[k] : r->origin_mm[k]);
        d[k] = (double)r->direction[k];
    }
    const bool met = capsule_walk_piece(&w, &b->cloth, o, d, 0.0, INFINITY, &e);
    *t = met ? e.t : INFINITY;
    return met;
}

static bool count_one(void *context, uint32_t i_segment, float sin_theta)
{
    (void)i_segment;
    assert_true(fabsf(sin_theta) <= 1.0001f);
    ++*(size_t *)context;
    return true;
}

/* Walks that go on in any direction, into fibers and out of them. */
static void compare(struct both *b)
{
    for (uint32_t i = 0; i < N_WALK; i++) {
        struct rng rng;
        struct scene_ray r;
        struct scene_hit h, from;
        rng_start(&rng, &(struct rng_key){.seed = 3}, i, 0);
        double o[3] = {2 * rng_double(&rng), 2 * rng_double(&rng), 0.01}, d[3] = {0.3 * rng_double(&rng), 0.2, -1};
        const double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        for (int k = 0; k < 3; k++) d[k] /= length;
        assert_true(scene_ray_enter(b->scene, o, d, &r));
        for (int k = 0; k < N_STEP; k++) {
            double t;
            size_t n_face = 0;
            const bool expected = by_definition(b, &r, k > 0 ? &from : NULL, &t),
                       occluded = scene_occluded(b->scene, &r);
            scene_visit_ahead(b->scene, &r, count_one, &n_face);
            const struct scene_ray start = r;
            const bool met = scene_trace(b->scene, &r, &h);
            b->n_ray++;
            b->n_hit += met;
            b->n_occluded += occluded != met;
            b->n_visited += met && n_face == 0;
            double far = 0;
            for (int a = 0; a < 3 && met && expected; a++) {
                const double x = (double)h.position_mm[a] + (a < 2 ? r.offset_mm[a] - start.offset_mm[a] : 0.0);
                far += fabs(x - (double)(k > 0 ? from.position_mm[a] : start.origin_mm[a]) -
                            t * (double)start.direction[a]);
            }
            b->n_other += met != expected || far > 0.05 * (double)h.radius_mm;
            if (!met) break;
            float next[3];
            any_direction(&rng, next);
            from = h;
            scene_ray_leave(&h, r.offset_mm, next, &r);
        }
    }
    print_message("%zu rays, %zu hits, %zu other ones, %zu other shadows\n", b->n_ray, b->n_hit, b->n_other,
                  b->n_occluded);
    assert_true(b->n_hit > N_WALK);
    assert_int_equal(b->n_occluded, 0);
    assert_int_equal(b->n_visited, 0);
    assert_true((double)b->n_other < 8e-3 * (double)b->n_ray); /* rounding decides at edges and where a ray starts */
}

static void rays_of_a_weave_that_overlaps(void **state)
{
    (void)state;
    struct both b = {0};
    hand_weave_small(&b.fibers);
    open_both(&b);
    compare(&b);
    close_both(&b);
}

static void rays_through_fibers_of_changing_radius(void **state)
{
    (void)state;
    struct both b = {0};
    hand_weave_small(&b.fibers);
    assert_int_equal(fiber_set_add_shapes(&b.fibers, NULL), STATUS_OK);
    for (size_t v = 0; v < b.fibers.n_vertex; v++)
        b.fibers.shape[v].radius *= v % 3 == 0 ? 1.3f : v % 3 == 1 ? 0.6f : 1;
    open_both(&b);
    compare(&b);
    close_both(&b);
}

/* Fibers that are longer than their tile by far, and their ends in tiles beside it. */
static void rays_in_a_tile_that_is_smaller_than_a_fiber(void **state)
{
    (void)state;
    static const double y_z[3][2] = {{0.005e-3, 0}, {0.035e-3, -0.012e-3}, {0.02e-3, -0.06e-3}};
    struct both b = {0};
    hand_straight(&b.fibers, 3, y_z, 0.04e-3, 10e-6);
    for (size_t v = 0; v < 6; v++) b.fibers.position_m[3 * v + 1] += v % 2 == 1 ? 0.08e-3f : 0;
    open_both(&b);
    compare(&b);
    close_both(&b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rays_of_a_weave_that_overlaps),
        cmocka_unit_test(rays_through_fibers_of_changing_radius),
        cmocka_unit_test(rays_in_a_tile_that_is_smaller_than_a_fiber),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
