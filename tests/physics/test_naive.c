/* The renderer against the naive tracer of tests/support on a small woven cloth: two implementations that must agree.
 * The lamp is large, so that the naive one finds it, and the lobes are wide, so that its directions serve.
 * A difference of 4 % in all configurations fails the test; of 0.5 % with the paths of `make test-long`.
 */
#include "base/angle.h"
#include "renderer/estimate/estimate.h"
#include "tests/support/agreement.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/statistics_test.h"
#include "tests/support/tracer/naive_tracer.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { N_TASK = 64, TASK_PATHS = 1000, LONG_TASK_PATHS = 120000 };

struct job {
    struct fiber_set f;
    struct configuration c;
    double param[9];
    bool across_width;
    uint64_t seed;
    uint32_t n_path; /* a task */
    struct sample_mean mean[N_TASK];
};

static void run_task(void *context, size_t i_task, size_t i_thread)
{
    (void)i_thread;
    struct job *j = context;
    for (uint32_t i = 0; i < j->n_path; i++) {
        struct rng r;
        rng_start(&r, &(struct rng_key){j->seed, 0, 0, 0}, (uint32_t)i_task, i);
        sample_mean_add(&j->mean[i_task], naive_path(&j->f, &j->c, j->param, j->across_width, &r));
    }
}

static void agree(const struct configuration *c, const double *param, bool across_width, struct thread_pool *pool,
                  struct agreement *all)
{
    const uint64_t seed = 77 + (uint64_t)all->n;
    struct scattering_model two_lobe = *scattering_find("two_lobe.v1");
    static struct job j;
    struct scene *scene = NULL;
    struct error err = {0};
    struct estimate e;
    memset(&j, 0, sizeof j);
    hand_weave(&j.f, &(struct hand_weave_option){2, 6, 12, 0.4e-3, 16e-6, 1});
    j.c = *c;
    j.seed = seed;
    two_lobe.across_width = j.across_width = across_width;
    j.n_path = is_long_variant() ? LONG_TASK_PATHS : TASK_PATHS;
    memcpy(j.param, param, sizeof j.param);
    assert_int_equal(thread_pool_run(pool, N_TASK, run_task, &j, NULL), STATUS_OK);
    struct sample_mean batch = {0};
    for (int i = 0; i < N_TASK; i++) sample_mean_add(&batch, j.mean[i].mean);

    if (scene_new(&j.f, &(struct scene_option){true}, &scene, &err) != STATUS_OK) fail_msg("%s", err.text);
    struct appearance model;
    const size_t n_path = 4 * N_TASK * (size_t)j.n_path;
    struct estimate_request q = {.input = trace_input_surface(scene, &two_lobe, param, &model),
                                 .configuration = c,
                                 .n_configuration = 1,
                                 .n_path = &n_path,
                                 .seed = seed};
    if (estimate_run(&q, pool, NULL, &e, &err) != STATUS_OK) fail_msg("%s", err.text);
    agreement_add(all, batch.mean, sample_mean_se(&batch), e.mean[0], sqrt(e.var[0]));
    scene_free(scene);
    fiber_set_release(&j.f);
}

static void two_tracers(bool across_width)
{
    struct thread_pool *pool = NULL;
    assert_int_equal(thread_pool_new(0, &pool, NULL), STATUS_OK);
    struct agreement all = {0};
    const double wide[9] = {0.12, 0.12, 0.12, 0.4, 0.4, 0.4, 10 * RAD_PER_DEG, 45 * RAD_PER_DEG, 45 * RAD_PER_DEG};
    const double narrower[9] = {0.2, 0.2, 0.2, 0.35, 0.35, 0.35, 10 * RAD_PER_DEG, 38 * RAD_PER_DEG, 40 * RAD_PER_DEG};
    agree(&(struct configuration){30 * RAD_PER_DEG, 180 * RAD_PER_DEG, 20 * RAD_PER_DEG, 0, 0, 0.61, 1.0, 1.0, 0.01},
          wide, across_width, pool, &all);
    agree(&(struct configuration){60 * RAD_PER_DEG, 100 * RAD_PER_DEG, 50 * RAD_PER_DEG, 20 * RAD_PER_DEG,
                                  35 * RAD_PER_DEG, 0.61, 1.0, 0.5, 0.01},
          wide, across_width, pool, &all);
    agree(&(struct configuration){45 * RAD_PER_DEG, 250 * RAD_PER_DEG, 40 * RAD_PER_DEG, 90 * RAD_PER_DEG,
                                  90 * RAD_PER_DEG, 0.61, 1.2, 1.0, 0.02},
          narrower, across_width, pool, &all);
    agreement_check(&all, is_long_variant() ? 0.005 : 0.04);
    thread_pool_free(pool);
}

static void two_tracers_agree(void **state)
{
    (void)state;
    two_tracers(false);
}

static void two_tracers_agree_across_the_width(void **state)
{
    (void)state;
    two_tracers(true);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(two_tracers_agree),
                                       cmocka_unit_test(two_tracers_agree_across_the_width)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
