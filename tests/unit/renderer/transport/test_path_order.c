/* The order of paths: each one once, and neighbours in the tile one after the other. */
#include "renderer/transport/surface/path_order.h"

#include "base/rng.h"
#include "renderer/transport/radiance_tracer.h"
#include "tests/support/cloth/hand_weave.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

enum { N = RADIANCE_MOST_PATHS };

/* Mean distance in the tile, whose edge is 1, of paths that follow each other. */
static double mean_step(const struct camera *camera, const struct scene *scene, double (*xy)[2], const uint32_t *order)
{
    double tile_mm[2], before[2] = {0, 0}, sum = 0;
    scene_tile_mm(scene, tile_mm);
    for (size_t i = 0; i < N; i++) {
        struct scene_ray ray;
        double step2 = 0;
        assert_true(camera_ray(camera, scene, xy[order[i]], &ray));
        for (int a = 0; a < 2; a++) {
            const double at = (double)ray.origin_mm[a] / tile_mm[a], apart = fabs(at - before[a]);
            step2 += fmin(apart, 1 - apart) * fmin(apart, 1 - apart);
            before[a] = at;
        }
        sum += sqrt(step2) / N;
    }
    return sum;
}

static void neighbours_follow_each_other(void **state)
{
    (void)state;
    const struct configuration c = {.camera_theta_rad = 0.5, .camera_distance_m = 1, .crop_m = 0.01};
    static double xy[N][2];
    static uint32_t order[N], own[N];
    static bool seen[N];
    struct fiber_set f;
    struct scene *scene;
    struct camera camera;
    struct rng r;
    hand_weave_small(&f);
    assert_int_equal(scene_new(&f, &(struct scene_option){.black_sheet = true}, &scene, NULL), STATUS_OK);
    fiber_set_release(&f);
    camera_init(&camera, &c);
    rng_start(&r, &(struct rng_key){.seed = 1}, 0, 0);
    for (uint32_t i = 0; i < N; i++) {
        for (int a = 0; a < 2; a++) xy[i][a] = rng_double(&r);
        own[i] = i;
    }
    memset(seen, 0, sizeof seen);
    path_order_fill(&camera, scene, N, xy, order);
    for (size_t i = 0; i < N; i++) {
        assert_true(order[i] < N && !seen[order[i]]);
        seen[order[i]] = true;
    }
    assert_true(mean_step(&camera, scene, xy, own) > 0.3); /* 0.38 of places at random */
    assert_true(mean_step(&camera, scene, xy, order) < 2.0 / 64);
    scene_free(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(neighbours_follow_each_other)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
