/* estimate_run: the same bits for any number of threads, right variances, cancellation, bad requests. */
#include "base/clock.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/statistics_test.h"
#include "tests/support/tracer/estimate_fixture.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static struct estimate_fixture fixture;

static int set_up(void **state)
{
    (void)state;
    return estimate_fixture_init(&fixture);
}

static int tear_down(void **state)
{
    (void)state;
    estimate_fixture_release(&fixture);
    return 0;
}

static void same_bits_for_any_threads(void **state)
{
    (void)state;
    const size_t n_path[4] = {1000, 256, 0, 2500};
    struct estimate_request q = estimate_fixture_request(&fixture, n_path, 4);
    struct estimate one[4], more[4];
    estimate_fixture_run(&q, 1, one);
    assert_int_equal(one[0].n_path, 1024);
    assert_int_equal(one[2].n_path, 0);
    assert_true(one[2].mean[0] == 0 && one[0].mean[0] > 0 && one[0].n_bounce > 1024);
    for (size_t t = 2; t <= 3; t++) {
        estimate_fixture_run(&q, t, more);
        assert_memory_equal(one, more, sizeof one);
    }
    /* a configuration does not depend on the others of a request; other keys give other numbers */
    const size_t only_last[4] = {0, 0, 0, 2500};
    struct estimate_request alone = estimate_fixture_request(&fixture, only_last, 4);
    estimate_fixture_run(&alone, 2, more);
    assert_memory_equal(&one[3], &more[3], sizeof one[3]);
    alone.replica = 2;
    estimate_fixture_run(&alone, 2, more);
    assert_true(more[3].mean[0] != one[3].mean[0]);
    /* without derivatives the same radiance */
    q.input.want_derivative = false;
    estimate_fixture_run(&q, 1, more);
    for (int c = 0; c < 3; c++)
        assert_true(more[0].mean[c] == one[0].mean[c] && more[0].var[c] == one[0].var[c] && more[0].jac[c] == 0);
}

/* Tasks of a large request are of more blocks than those of a small one: neither order nor sums may show it. */
static void same_bits_in_large_requests(void **state)
{
    (void)state;
    const size_t all[4] = {8192, 8192, 8192, 8192}, only_last[4] = {0, 0, 0, 8192};
    struct estimate_request large = estimate_fixture_request(&fixture, all, 4),
                            small = estimate_fixture_request(&fixture, only_last, 4);
    struct estimate a[4], b[4];
    estimate_fixture_run(&large, 2, a);
    estimate_fixture_run(&small, 2, b);
    assert_int_equal(a[3].n_path, 8192);
    assert_memory_equal(&a[3], &b[3], sizeof a[3]);
}

/* The stated variance of the mean against the variance of repeated estimates. */
static void variances_agree_with_repetitions(void **state)
{
    (void)state;
    enum { N = 60 };
    const size_t n_path[1] = {2048};
    struct sample_mean mean = {0}, jac = {0};
    double var = 0, jac_var = 0;
    for (uint32_t i = 0; i < N; i++) {
        struct estimate e;
        struct estimate_request q = estimate_fixture_request(&fixture, n_path, 1);
        q.iteration = i;
        estimate_fixture_run(&q, 1, &e);
        sample_mean_add(&mean, e.mean[0]);
        sample_mean_add(&jac, e.jac[3]); /* C_TT.r on r */
        var += e.var[0] / N;
        jac_var += e.jac_var[3] / N;
    }
    /* a sample variance of 60 has a relative standard error of 0.18 for normal deviates, a little more for these */
    double ratio = mean.m2 / (N - 1) / var, jac_ratio = jac.m2 / (N - 1) / jac_var;
    if (fabs(ratio - 1) > 0.65 || fabs(jac_ratio - 1) > 0.65) fail_msg("variance ratios %g, %g", ratio, jac_ratio);
}

/* With the same random numbers, only rays that graze an edge may have another result. */
static void agrees_without_avx512(void **state)
{
    (void)state;
    const size_t n_path[2] = {65536, 65536};
    struct fiber_set f;
    struct error err = {0};
    struct scene *plain = NULL;
    struct estimate with[2], without[2];
    struct estimate_request q = estimate_fixture_request(&fixture, n_path, 2);
    hand_weave_small(&f);
    if (scene_new(&f, &(struct scene_option){.black_sheet = true, .no_avx512 = true}, &plain, &err) != STATUS_OK)
        fail_msg("%s", err.text);
    assert_int_equal(estimate_run(&q, NULL, NULL, with, &err), STATUS_OK);
    q.input.scene.fibers = plain;
    assert_int_equal(estimate_run(&q, NULL, NULL, without, &err), STATUS_OK);
    for (int i = 0; i < 2; i++)
        for (int c = 0; c < 3; c++) {
            double se = sqrt(with[i].var[c]), off = fabs(with[i].mean[c] - without[i].mean[c]);
            if (!(off < 0.3 * se))
                fail_msg("configuration %d, channel %d: %g, without %g", i, c, with[i].mean[c], without[i].mean[c]);
        }
    scene_free(plain);
    fiber_set_release(&f);
}

struct canceller {
    atomic_bool flag;
    double at_s;
};

static void *cancel_soon(void *canceller)
{
    struct canceller *c = canceller;
    usleep(60000);
    c->at_s = clock_monotonic_s();
    atomic_store(&c->flag, true);
    return NULL;
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* White fibers have the longest paths. The median of five tries is used, so that a single delay by a busy machine has
 * no effect. */
static void cancels_within_100_ms(void **state)
{
    (void)state;
    const double white[9] = {0.001, 0.001, 0.001, 0.999, 0.999, 0.999, 0.1, 0.4, 0.4};
    const size_t n_path[1] = {200000000};
    struct estimate_request q = estimate_fixture_request(&fixture, n_path, 1);
    struct thread_pool *pool = NULL;
    struct error err = {0};
    double late_s[5];
    q.input.param = white;
    assert_int_equal(thread_pool_new(2, &pool, &err), STATUS_OK);
    for (int k = 0; k < 5; k++) {
        struct estimate e;
        struct canceller c = {.at_s = 0};
        struct progress progress = {NULL, NULL, &c.flag};
        pthread_t thread;
        pthread_create(&thread, NULL, cancel_soon, &c);
        assert_int_equal(estimate_run(&q, pool, &progress, &e, &err), STATUS_CANCELLED);
        double back_s = clock_monotonic_s();
        pthread_join(thread, NULL);
        late_s[k] = back_s - c.at_s;
    }
    thread_pool_free(pool);
    qsort(late_s, 5, sizeof *late_s, by_size);
    print_message("cancelled in %.1f ms (median), %.1f ms at most\n", 1e3 * late_s[2], 1e3 * late_s[4]);
    if (late_s[2] > 0.1) fail_msg("took %.3f s after the flag", late_s[2]);
}

static void bad_requests(void **state)
{
    (void)state;
    const size_t n_path[1] = {256};
    struct estimate e;
    struct error err = {0};
    struct estimate_request q = estimate_fixture_request(&fixture, n_path, 1);
    double param[SCATTERING_MAX_PARAM];
    memcpy(param, fixture.start, sizeof param);
    param[6] = NAN;
    q.input.param = param;
    assert_int_equal(estimate_run(&q, NULL, NULL, &e, &err), STATUS_INVALID);
    assert_string_equal(err.field, "beta_R");
    q = estimate_fixture_request(&fixture, n_path, 1);
    struct configuration c = fixture.configuration[0];
    c.camera_theta_rad = M_PI_2;
    q.configuration = &c;
    assert_int_equal(estimate_run(&q, NULL, NULL, &e, &err), STATUS_INVALID);
    q = estimate_fixture_request(&fixture, n_path, 1);
    q.iteration = 70000;
    assert_int_equal(estimate_run(&q, NULL, NULL, &e, &err), STATUS_INVALID);
}

/* A model that returns NaN for one direction in a thousand is found and named. */
static float broken_eval_pdf(const struct scattering_state *s, const float wi[3], const float wo[3],
                             const float *weight, float rgb[3], float *score)
{
    float pdf = scattering_find("isotropic.v1")->eval_pdf(s, wi, wo, weight, rgb, score);
    if (score != NULL && fabsf(wi[0]) > 0.99f) score[1] = NAN;
    return pdf;
}

static void nan_is_named(void **state)
{
    (void)state;
    const size_t n_path[2] = {0, 4096}; /* the first is not traced */
    struct scattering_model broken = *scattering_find("isotropic.v1");
    broken.id = "broken.v1";
    broken.eval_pdf = broken_eval_pdf;
    const double param[3] = {0.5, 0.5, 0.5};
    struct estimate e[2];
    struct error err = {0};
    struct estimate_request q = estimate_fixture_request(&fixture, n_path, 2);
    q.input = trace_input_surface(fixture.scene, &broken, param, &fixture.model);
    q.input.want_derivative = true;
    assert_int_equal(estimate_run(&q, NULL, NULL, e, &err), STATUS_NUMERIC);
    assert_non_null(strstr(err.text, "broken.v1"));
    char view[CONFIGURATION_TEXT];
    configuration_describe(&q.configuration[1], view);
    if (strstr(err.text, view) == NULL) fail_msg("'%s' does not name %s", err.text, view);
    assert_string_equal(err.field, "C.g");
}

/* Because of rounding, one sample in 2^24 may be a direction along the fiber, where density and S are 0. It ends the
 * path and is not an error of the model. */
static float rounding_eval_pdf(const struct scattering_state *s, const float wi[3], const float wo[3],
                               const float *weight, float rgb[3], float *score)
{
    float pdf = scattering_find("isotropic.v1")->eval_pdf(s, wi, wo, weight, rgb, score);
    if (fabsf(wi[0]) <= 0.99f) return pdf;
    rgb[0] = rgb[1] = rgb[2] = 0;
    return 0;
}

static void samples_without_density(void **state)
{
    (void)state;
    const size_t n_path[1] = {4096};
    struct scattering_model rounding = *scattering_find("isotropic.v1");
    rounding.eval_pdf = rounding_eval_pdf;
    const double param[3] = {0.5, 0.5, 0.5};
    struct estimate e;
    struct error err = {0};
    struct estimate_request q = estimate_fixture_request(&fixture, n_path, 1);
    q.input = trace_input_surface(fixture.scene, &rounding, param, &fixture.model);
    q.input.want_derivative = true;
    if (estimate_run(&q, NULL, NULL, &e, &err) != STATUS_OK) fail_msg("%s", err.text);
    assert_true(e.mean[0] > 0 && isfinite(e.jac[0]));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(same_bits_for_any_threads),
        cmocka_unit_test(same_bits_in_large_requests),
        cmocka_unit_test(variances_agree_with_repetitions),
        cmocka_unit_test(agrees_without_avx512),
        cmocka_unit_test(cancels_within_100_ms),
        cmocka_unit_test(bad_requests),
        cmocka_unit_test(nan_is_named),
        cmocka_unit_test(samples_without_density),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
