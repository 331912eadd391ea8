/* render_run for volumes: agreement with estimate_run, the same bits for any number of threads, layers and names,
 * files, progress and cancellation. */
#include "renderer/estimate/estimate.h"
#include "renderer/estimate/render.h"
#include "renderer/transport/volume/volume_scene.h"
#include "tests/support/scan/hand_volume.h"
#include "tests/support/scratch_folder.h"
#include "tests/support/tracer/estimate_fixture.h"
#include "tests/support/tracer/orbit_configurations.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

static double param[SCATTERING_MAX_PARAM];
static struct configuration configuration[16];
static struct volume_scene scene;
static struct trace_volume volume_model;

static int set_up(void **state)
{
    (void)state;
    const size_t n[3] = {30, 34, 13};
    struct direction_volume v;
    const struct phase_model *m = phase_find("phase_two_lobe.v1");
    for (size_t p = 0; p < m->n_param; p++) param[p] = m->param[p].start;
    orbit_configurations_16(configuration);
    hand_volume_weave(&v, n, 8e-6, 0.4);
    if (volume_scene_init(&scene, &v, &(struct volume_scene_option){true}, NULL) != STATUS_OK) return 1;
    direction_volume_release(&v);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    volume_scene_release(&scene);
    return 0;
}

static struct render_request request(const struct configuration *c)
{
    struct render_request q = {
        .input = trace_input_volume(&scene, phase_find("phase_two_lobe.v1"), param, 4e4, &volume_model),
        .configuration = c,
        .width = 24,
        .height = 20,
        .n_sample = 32,
        .seed = 5};
    q.input.want_derivative = true;
    return q;
}

static void layers_and_threads(void **state)
{
    (void)state;
    struct render_request q = request(&configuration[1]);
    struct image im[3];
    for (size_t i = 0; i < 3; i++) render_fixture_run(&q, i + 1, &im[i]);
    assert_int_equal(im[0].n_channel, 6 + 39);
    for (size_t i = 1; i < 3; i++)
        assert_memory_equal(im[0].pixel, im[i].pixel, 24 * 20 * im[0].n_channel * sizeof(float));
    assert_string_equal(im[0].channel_name[4], "var.G");
    assert_string_equal(im[0].channel_name[6 + 3 * 9], "d_alpha.r.R");
    assert_string_equal(im[0].channel_name[6 + 3 * 12 + 2], "d_density_multiplier.B");
    for (size_t i = 0; i < 3; i++) image_release(&im[i]);
}

/* The mean over the pixels is the mean of the crop, within the stated standard errors of both. The same holds for the
 * derivatives by alpha and d. Their pixels state no standard error, so that of the estimate is used for both, which
 * has as many paths. */
static void agrees_with_estimate(void **state)
{
    (void)state;
    enum { N_PATH = 61440 };
    const size_t n_path[1] = {N_PATH};
    for (int k = 0; k < 16; k += 6) {
        struct render_request q = request(&configuration[k]);
        struct image im;
        struct estimate e;
        struct error err = {0};
        q.n_sample = N_PATH / (24 * 20);
        render_fixture_run(&q, 2, &im);
        struct estimate_request r = {
            .input = q.input, .configuration = &configuration[k], .n_configuration = 1, .n_path = n_path, .seed = 6};
        if (estimate_run(&r, NULL, NULL, &e, &err) != STATUS_OK) fail_msg("%s", err.text);
        double mean = 0, var = 0, by_alpha = 0, by_d = 0, n = 24 * 20;
        for (size_t i = 0; i < 24 * 20; i++) {
            const float *pixel = im.pixel + i * im.n_channel;
            mean += (double)pixel[1] / n;
            var += (double)pixel[4] / (n * n);
            by_alpha += (double)pixel[6 + 3 * 10 + 1] / n;
            by_d += (double)pixel[6 + 3 * 12 + 1] / n;
        }
        double se = sqrt(var + e.var[1]);
        if (fabs(mean - e.mean[1]) > 4 * se) fail_msg("render %g, estimate %g, standard error %g", mean, e.mean[1], se);
        const size_t at[2] = {13 + 10, 13 + 12};
        const double got[2] = {by_alpha, by_d};
        for (int i = 0; i < 2; i++)
            if (fabs(got[i] - e.jac[at[i]]) > 4 * sqrt(2 * e.jac_var[at[i]]))
                fail_msg("derivative %d: render %g, estimate %g +- %g", i, got[i], e.jac[at[i]],
                         sqrt(e.jac_var[at[i]]));
        image_release(&im);
    }
}

static void files(void **state)
{
    struct render_request q = request(&configuration[2]);
    struct image im, back;
    struct error err = {0};
    const char *exr = scratch_path(state, "v.exr"), *png = scratch_path(state, "v.png");
    render_fixture_run(&q, 1, &im);
    if (image_write_exr(&im, exr, &err) != STATUS_OK) fail_msg("%s", err.text);
    if (image_write_png(&im, 2, png, &err) != STATUS_OK) fail_msg("%s", err.text);
    if (image_read_exr(&back, exr, 1000, &err) != STATUS_OK) fail_msg("%s", err.text);
    for (size_t i = 0; i < 24 * 20; i++)
        assert_memory_equal(back.pixel + 3 * i, im.pixel + im.n_channel * i, 3 * sizeof(float));
    image_release(&im);
    image_release(&back);
}

struct watch {
    atomic_bool cancel;
    struct timespec cancelled;
    double fraction;
    bool falling;
};

static void listen(void *context, double fraction)
{
    struct watch *w = context;
    w->falling |= fraction < w->fraction;
    w->fraction = fraction;
}

static void *cancel_soon(void *context)
{
    struct watch *w = context;
    nanosleep(&(struct timespec){0, 150000000}, NULL);
    clock_gettime(CLOCK_MONOTONIC, &w->cancelled);
    atomic_store(&w->cancel, true);
    return NULL;
}

/* The rendering of a picture with one pixel or many, which would take many seconds, ends within 100 ms after it is
 * cancelled. Up to three tries are made, because the machine may be busy. */
static void cancelled_soon(void **state)
{
    (void)state;
    const size_t size[2] = {1, 200};
    for (int k = 0; k < 2; k++) {
        double waited = 1;
        for (int attempt = 0; attempt < 3 && waited > 0.1; attempt++) {
            struct watch w = {.cancel = false};
            const struct progress progress = {listen, &w, &w.cancel};
            struct render_request q = request(&configuration[3]);
            struct thread_pool *pool = NULL;
            struct timespec now;
            struct image im;
            pthread_t thread;
            q.width = q.height = size[k];
            q.n_sample = 40000000 / (size[k] * size[k]);
            assert_int_equal(thread_pool_new(2, &pool, NULL), STATUS_OK);
            assert_int_equal(pthread_create(&thread, NULL, cancel_soon, &w), 0);
            assert_int_equal(render_run(&q, pool, &progress, &im, NULL), STATUS_CANCELLED);
            clock_gettime(CLOCK_MONOTONIC, &now);
            pthread_join(thread, NULL);
            thread_pool_free(pool);
            assert_null(im.pixel);
            assert_false(w.falling);
            waited = (double)(now.tv_sec - w.cancelled.tv_sec) + 1e-9 * (double)(now.tv_nsec - w.cancelled.tv_nsec);
        }
        if (waited > 0.1) fail_msg("%zu x %zu pixels: cancelled after %.3f s", size[k], size[k], waited);
    }
    struct watch w = {.cancel = false};
    const struct progress progress = {listen, &w, &w.cancel};
    struct render_request q = request(&configuration[3]);
    struct image im;
    assert_int_equal(render_run(&q, NULL, &progress, &im, NULL), STATUS_OK);
    assert_true(w.fraction == 1 && !w.falling);
    image_release(&im);
}

static void bad_requests(void **state)
{
    (void)state;
    struct render_request q = request(&configuration[0]);
    struct configuration c = configuration[0];
    struct image im;
    struct error err = {0};
    q.n_sample = 0;
    assert_int_equal(render_run(&q, NULL, NULL, &im, &err), STATUS_INVALID);
    q = request(&c);
    c.crop_m = -1;
    assert_int_equal(render_run(&q, NULL, NULL, &im, &err), STATUS_INVALID);
    q = request(&configuration[0]);
    volume_model.param[volume_model.model.n_param - 1] = 0;
    assert_int_equal(render_run(&q, NULL, NULL, &im, &err), STATUS_INVALID);
    assert_string_equal(err.field, MODEL_DENSITY_MULTIPLIER);
}

static void needs_the_cloth_that_its_model_asks_for(void **state)
{
    (void)state;
    struct appearance a;
    struct image im;
    struct error err = {0};
    struct render_request q = request(&configuration[1]);
    assert_true(appearance_find("two_lobe.v1", &a));
    q.input.model = &a;
    assert_int_equal(render_run(&q, NULL, NULL, &im, &err), STATUS_INVALID);
    assert_string_equal(err.field, "model");
    q = request(&configuration[1]);
    q.input.n_set = 2;
    assert_int_equal(render_run(&q, NULL, NULL, &im, &err), STATUS_INVALID);
    assert_string_equal(err.field, "n_set");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(layers_and_threads),
        cmocka_unit_test(agrees_with_estimate),
        cmocka_unit_test_setup_teardown(files, scratch_folder_setup, scratch_folder_teardown),
        cmocka_unit_test(cancelled_soon),
        cmocka_unit_test(bad_requests),
        cmocka_unit_test(needs_the_cloth_that_its_model_asks_for),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
