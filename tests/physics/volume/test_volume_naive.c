/* The volume renderer against the naive volume tracer of tests/support: two implementations that must agree. The lamp
 * is large, so that the naive one finds it, and the lobes are wide, so that its directions serve.
 * A difference of 4 % in all configurations fails the test; of 0.5 % with the paths of `make test-long`. */
#include "base/angle.h"
#include "base/thread_pool.h"
#include "renderer/estimate/estimate.h"
#include "renderer/transport/volume/volume_scene.h"
#include "tests/support/agreement.h"
#include "tests/support/scan/hand_volume.h"
#include "tests/support/statistics_test.h"
#include "tests/support/tracer/naive_volume.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { N_TASK = 64, LONG_FACTOR = 70 };

struct job {
    struct naive_volume naive;
    struct configuration c;
    uint64_t seed;
    uint32_t n_path; /* a task */
    struct sample_mean mean[N_TASK];
};

static struct direction_volume volume;

static int set_up(void **state)
{
    (void)state;
    const size_t n[3] = {21, 18, 9}; /* no whole number of bricks */
    hand_volume_weave(&volume, n, 10e-6, 0.5);
    for (size_t i = 0; i < n[0]; i++) { /* a thin layer on top and one below, of fibers on the slant */
        const float slant[3] = {0.3f, 0.9f, -0.2f};
        for (size_t k = 0; k < n[2]; k += n[2] - 1) {
            size_t at = volume_index(n, i, i % n[1], k);
            volume.density[at] = 120;
            direction_volume_set(&volume, at, slant);
        }
    }
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    direction_volume_release(&volume);
    return 0;
}

static void run_task(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    struct job *j = context;
    for (uint32_t i = 0; i < j->n_path; i++) {
        struct rng r;
        rng_start(&r, &(struct rng_key){j->seed, 0, 0, 0}, (uint32_t)i_task, i);
        sample_mean_add(&j->mean[i_task], naive_volume_path(&j->naive, &j->c, &r));
    }
}

static void agree(struct configuration c, double sky, bool black_sheet, double d_per_m, const double *param,
                  uint32_t n_task_path, uint64_t seed, struct thread_pool *pool, struct agreement *all)
{
    static struct job j;
    struct volume_scene scene;
    struct error err = {0};
    struct estimate e;
    const size_t n_path = 300000 * (is_long_variant() ? LONG_FACTOR : 1);
    memset(&j, 0, sizeof j);
    naive_volume_init(&j.naive, &volume, param, d_per_m, black_sheet, sky);
    j.c = c;
    j.seed = seed;
    j.n_path = n_task_path * (is_long_variant() ? LONG_FACTOR : 1);
    assert_int_equal(thread_pool_run(pool, N_TASK, run_task, &j, NULL), STATUS_OK);
    struct sample_mean batch = {0};
    for (int i = 0; i < N_TASK; i++) sample_mean_add(&batch, j.mean[i].mean);
    for (int k = 0; k < 3; k++) c.environment_rgb[k] = sky;
    assert_int_equal(volume_scene_init(&scene, &volume, &(struct volume_scene_option){black_sheet}, &err), STATUS_OK);
    struct trace_volume volume_model;
    const struct estimate_request q = {
        .input = trace_input_volume(&scene, phase_find("phase_two_lobe.v1"), param, d_per_m, &volume_model),
        .configuration = &c,
        .n_configuration = 1,
        .n_path = &n_path,
        .seed = seed};
    if (estimate_run(&q, pool, NULL, &e, &err) != STATUS_OK) fail_msg("%s", err.text);
    agreement_add(all, batch.mean, sample_mean_se(&batch), e.mean[0], sqrt(e.var[0]));
    volume_scene_release(&scene);
}

static void two_tracers_agree(void **state)
{
    (void)state;
    struct thread_pool *pool = NULL;
    struct agreement all = {0};
    assert_int_equal(thread_pool_new(0, &pool, NULL), STATUS_OK);
    const double wide[12] = {0.12, 0.12, 0.12, 0.4, 0.4, 0.4, 10 * RAD_PER_DEG, 45 * RAD_PER_DEG, 45 * RAD_PER_DEG,
                             0.7,  0.7,  0.7};
    const double narrower[12] = {0.3, 0.3, 0.3, 0.35, 0.35, 0.35, 10 * RAD_PER_DEG, 38 * RAD_PER_DEG, 40 * RAD_PER_DEG,
                                 0.9, 0.9, 0.9};
    agree((struct configuration){30 * RAD_PER_DEG, 180 * RAD_PER_DEG, 20 * RAD_PER_DEG, 0, 0, 0.61, 1.0, 1.0, 0.01}, 0,
          true, 5e4, wide, 1500, 78, pool, &all);
    agree((struct configuration){60 * RAD_PER_DEG, 100 * RAD_PER_DEG, 50 * RAD_PER_DEG, 20 * RAD_PER_DEG,
                                 35 * RAD_PER_DEG, 0.61, 1.0, 0.5, 0.01},
          0.2, true, 2e4, narrower, 4000, 79, pool, &all);
    /* back light, seen through the cloth and beside it */
    agree((struct configuration){170 * RAD_PER_DEG, 40 * RAD_PER_DEG, 25 * RAD_PER_DEG, 0, 0.3, 0.61, 1.0, 1.0, 0.01},
          0, false, 3e4, wide, 1000, 80, pool, &all);
    struct configuration sky = {0, 0, 35 * RAD_PER_DEG, 1, 0.3, 1, 1, 1.0, 0.01, .light = LIGHT_NO_LAMP};
    agree(sky, 0.7, true, 4e4, narrower, 4000, 81, pool, &all);
    agreement_check(&all, is_long_variant() ? 0.005 : 0.04);
    thread_pool_free(pool);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(two_tracers_agree)};
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
