/* Volumes at the faces of their tile: tiles that are written side by side are the same cloth, and the mean over whole
 * tiles does not depend on where the tile begins. A difference of 2 % fails the tests. */
#include "base/angle.h"
#include "base/thread_pool.h"
#include "renderer/estimate/estimate.h"
#include "renderer/transport/volume/volume_scene.h"
#include "tests/support/agreement.h"
#include "tests/support/scan/hand_volume.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { N_EDGE = 22, N_HIGH = 9, N_PATH = 400000 }; /* edges that are no whole number of bricks */
static const double voxel_m = 10e-6, per_m = 4e4;
static const double param[12] = {0.1, 0.2, 0.3, 0.8, 0.6, 0.4, 8 * RAD_PER_DEG, 20 * RAD_PER_DEG, 30 * RAD_PER_DEG,
                                 0.9, 0.9, 0.9};
static struct direction_volume tile;
static struct thread_pool *pool;

static int set_up(void **state)
{
    (void)state;
    hand_volume_weave(&tile, (size_t[3]){N_EDGE, N_EDGE, N_HIGH}, voxel_m, 0.5);
    return thread_pool_new(0, &pool, NULL) == STATUS_OK ? 0 : -1;
}

static int tear_down(void **state)
{
    (void)state;
    thread_pool_free(pool);
    direction_volume_release(&tile);
    return 0;
}

/* A volume of n[0] x n[1] columns whose first one is column (x, y) of the endless cloth of `tile`. */
static void part_of_cloth(struct direction_volume *part, size_t nx, size_t ny, size_t x, size_t y)
{
    const size_t n[3] = {nx, ny, N_HIGH}, n_tile[3] = {N_EDGE, N_EDGE, N_HIGH};
    const float up[3] = {0, 0, 1};
    hand_volume_uniform(part, n, voxel_m, 0, up);
    for (size_t k = 0; k < n[2]; k++)
        for (size_t j = 0; j < n[1]; j++)
            for (size_t i = 0; i < n[0]; i++) {
                size_t to = volume_index(n, i, j, k),
                       from = volume_index(n_tile, (x + i) % N_EDGE, (y + j) % N_EDGE, k);
                float d[3];
                direction_volume_get(&tile, from, d);
                part->density[to] = tile.density[from];
                direction_volume_set(part, to, d);
            }
}

static void trace(const struct direction_volume *v, struct configuration c, uint64_t seed, struct estimate *e)
{
    struct volume_scene scene;
    struct trace_volume model;
    struct error err = {0};
    const size_t n_path = N_PATH;
    if (volume_scene_init(&scene, v, &(struct volume_scene_option){true}, &err) != STATUS_OK) fail_msg("%s", err.text);
    const struct estimate_request q = {
        .input = trace_input_volume(&scene, phase_find("phase_two_lobe.v1"), param, per_m, &model),
        .configuration = &c,
        .n_configuration = 1,
        .n_path = &n_path,
        .seed = seed};
    if (estimate_run(&q, pool, NULL, e, &err) != STATUS_OK) fail_msg("%s", err.text);
    volume_scene_release(&scene);
}

/* Lamp at a grazing angle: light runs through many tiles. Random numbers are equal, but positions are rounded at other
 * places, so paths part after some bounces. */
static void repeated_tiles_are_the_same_cloth(void **state)
{
    (void)state;
    static const size_t repeat[2][2] = {{2, 1}, {3, 2}};
    const struct configuration c = {
        80 * RAD_PER_DEG, 180 * RAD_PER_DEG, 70 * RAD_PER_DEG, 0.2, 0.3, 0.61, 0.1, 1.0, 0.01};
    struct agreement all = {0};
    struct estimate one, other;
    trace(&tile, c, 5, &one);
    for (int r = 0; r < 2; r++) {
        struct direction_volume cloth;
        part_of_cloth(&cloth, repeat[r][0] * N_EDGE, repeat[r][1] * N_EDGE, 0, 0);
        trace(&cloth, c, 5, &other);
        agreement_add(&all, other.mean[1], sqrt(other.var[1]), one.mean[1], sqrt(one.var[1]));
        direction_volume_release(&cloth);
    }
    agreement_check(&all, 0.02);
}

static void tile_begins_anywhere(void **state)
{
    (void)state;
    static const size_t first[3][2] = {{7, 0}, {0, 13}, {11, 5}};
    struct agreement all = {0};
    struct configuration c = {50 * RAD_PER_DEG, 30 * RAD_PER_DEG, 0, 0, 0, 0.61, 0.1, 1.0, 5 * N_EDGE * voxel_m};
    c.light = LIGHT_DIRECTIONAL;
    c.camera = CAMERA_FAR_FIELD;
    for (int s = 0; s < 3; s++) {
        struct direction_volume cloth;
        struct estimate one, other;
        part_of_cloth(&cloth, N_EDGE, N_EDGE, first[s][0], first[s][1]);
        trace(&tile, c, 20 + (uint64_t)s, &one);
        trace(&cloth, c, 30 + (uint64_t)s, &other);
        agreement_add(&all, other.mean[0], sqrt(other.var[0]), one.mean[0], sqrt(one.var[0]));
        direction_volume_release(&cloth);
    }
    agreement_check(&all, 0.02);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(repeated_tiles_are_the_same_cloth),
                                       cmocka_unit_test(tile_begins_anywhere)};
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
