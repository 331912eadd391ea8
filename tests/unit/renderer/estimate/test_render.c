/* render_run: agreement with estimate_run, the same bits for any number of threads, layers and names, back light. */
#include "renderer/estimate/estimate.h"
#include "renderer/estimate/render.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/tracer/estimate_fixture.h"
#include "tests/support/tracer/orbit_configurations.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static double start[SCATTERING_MAX_PARAM];
static struct appearance model;
static struct configuration configuration[16];

static int set_up(void **state)
{
    (void)state;
    const struct scattering_model *m = scattering_find("two_lobe.v1");
    for (size_t p = 0; p < m->n_param; p++) start[p] = m->param[p].start;
    orbit_configurations_16(configuration);
    return 0;
}

static struct scene *small_cloth(bool black_sheet)
{
    struct fiber_set f;
    struct scene *scene = NULL;
    struct error err = {0};
    hand_weave_small(&f);
    if (scene_new(&f, &(struct scene_option){black_sheet}, &scene, &err) != STATUS_OK) fail_msg("%s", err.text);
    fiber_set_release(&f);
    return scene;
}

static struct render_request request(const struct scene *scene, const struct configuration *c)
{
    struct render_request q = {.input = trace_input_surface(scene, scattering_find("two_lobe.v1"), start, &model),
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
    struct scene *scene = small_cloth(true);
    struct render_request q = request(scene, &configuration[1]);
    struct image one, two;
    render_fixture_run(&q, 1, &one);
    render_fixture_run(&q, 2, &two);
    assert_int_equal(one.n_channel, 6 + 27);
    assert_memory_equal(one.pixel, two.pixel, one.width * one.height * one.n_channel * sizeof(float));
    assert_string_equal(one.channel_name[2], "B");
    assert_string_equal(one.channel_name[4], "var.G");
    assert_string_equal(one.channel_name[6], "d_C_R.r.R");
    assert_string_equal(one.channel_name[6 + 3 * 8 + 2], "d_gamma_TT.B");
    double jac = 0, wrong = 0;
    for (size_t i = 0; i < one.width * one.height; i++) {
        jac += (double)one.pixel[i * one.n_channel + 6 + 3 * 3];       /* d_C_TT.r.R */
        wrong += (double)one.pixel[i * one.n_channel + 6 + 3 * 3 + 1]; /* d_C_TT.r.G */
    }
    assert_true(jac > 0 && wrong == 0);
    image_release(&one);
    image_release(&two);
    scene_free(scene);
}

/* The mean over the pixels is the mean of the crop, within the stated standard errors of both. */
static void agrees_with_estimate(void **state)
{
    (void)state;
    struct scene *scene = small_cloth(true);
    const size_t n_path[1] = {60000};
    for (int k = 0; k < 3; k++) {
        struct render_request q = request(scene, &configuration[k]);
        struct image im;
        struct estimate e;
        struct error err = {0};
        q.n_sample = 100;
        render_fixture_run(&q, 2, &im);
        struct estimate_request r = {
            .input = q.input, .configuration = &configuration[k], .n_configuration = 1, .n_path = n_path, .seed = 6};
        if (estimate_run(&r, NULL, NULL, &e, &err) != STATUS_OK) fail_msg("%s", err.text);
        double mean = 0, var = 0, n = (double)(im.width * im.height);
        for (size_t i = 0; i < im.width * im.height; i++) {
            mean += (double)im.pixel[i * im.n_channel + 1] / n;
            var += (double)im.pixel[i * im.n_channel + 4] / (n * n);
        }
        double se = sqrt(var + e.var[1]);
        if (fabs(mean - e.mean[1]) > 4 * se) fail_msg("render %g, estimate %g, standard error %g", mean, e.mean[1], se);
        image_release(&im);
    }
    scene_free(scene);
}

/* The variance of a pixel is that of its mean: pictures of two seeds differ as much as theirs say. */
static void variance_is_that_of_the_mean(void **state)
{
    (void)state;
    struct scene *scene = small_cloth(true);
    struct render_request q = request(scene, &configuration[0]);
    struct image one, two;
    enum { N_PAIR = 12 };
    double square = 0, var = 0;
    q.n_sample = 40;
    for (int pair = 0; pair < N_PAIR; pair++, q.seed++) {
        render_fixture_run(&q, 2, &one);
        q.seed++;
        render_fixture_run(&q, 2, &two);
        for (size_t i = 0; i < one.width * one.height; i++)
            for (size_t k = i * one.n_channel; k < i * one.n_channel + 3; k++) {
                square += pow((double)one.pixel[k] - (double)two.pixel[k], 2);
                var += (double)one.pixel[k + 3] + (double)two.pixel[k + 3];
            }
        image_release(&one);
        image_release(&two);
    }
    print_message("squared differences over variances: %.3f\n", square / var);
    /* over 24 pairs the ratio scattered by 0.07 a pair */
    assert_true(fabs(square / var - 1) < 4 * 0.07 / sqrt(N_PAIR));
    scene_free(scene);
}

/* With a lamp below, the black sheet stops all light. Without it light passes through the cloth and between its
 * fibers. */
static void back_light(void **state)
{
    (void)state;
    struct configuration c = configuration[0];
    c.light_theta_rad = M_PI;
    c.camera_theta_rad = 0.1;
    const size_t n_path[1] = {4096};
    for (int sheet = 0; sheet < 2; sheet++) {
        struct scene *scene = small_cloth(sheet);
        struct estimate e;
        struct estimate_request q = {.input = trace_input_surface(scene, scattering_find("two_lobe.v1"), start, &model),
                                     .configuration = &c,
                                     .n_configuration = 1,
                                     .n_path = n_path,
                                     .seed = 6};
        assert_int_equal(estimate_run(&q, NULL, NULL, &e, NULL), STATUS_OK);
        if (sheet)
            assert_true(e.mean[0] == 0);
        else
            assert_true(e.mean[0] > 0.01);
        scene_free(scene);
    }
}

static void bad_requests(void **state)
{
    (void)state;
    struct scene *scene = small_cloth(true);
    struct render_request q = request(scene, &configuration[0]);
    struct image im;
    struct error err = {0};
    q.n_sample = 0;
    assert_int_equal(render_run(&q, NULL, NULL, &im, &err), STATUS_INVALID);
    q = request(scene, &configuration[0]);
    atomic_bool flag = true;
    struct progress cancelled = {NULL, NULL, &flag};
    assert_int_equal(render_run(&q, NULL, &cancelled, &im, &err), STATUS_CANCELLED);
    assert_null(im.pixel);
    scene_free(scene);
}

/* Samples lie evenly in a pixel, so that light which is scattered once has less noise than independent samples, whose
 * variance is stated; samples from RENDER_HALF on are another half. */
static void samples_lie_evenly(void **state)
{
    (void)state;
    struct scene *scene = small_cloth(true);
    struct render_request q = request(scene, &configuration[1]);
    struct image half[2];
    double square = 0, stated = 0;
    q.input.want_derivative = false;
    q.input.n_hit = 1;
    for (q.seed = 1; q.seed <= 12; q.seed++) {
        for (size_t h = 0; h < 2; h++) {
            q.first_sample = h * RENDER_HALF;
            render_fixture_run(&q, 2, &half[h]);
        }
        for (size_t i = 0; i < q.width * q.height; i++)
            for (size_t c = 0; c < 3; c++) {
                const float *a = half[0].pixel + i * half[0].n_channel, *b = half[1].pixel + i * half[1].n_channel;
                square += pow((double)a[c] - (double)b[c], 2);
                stated += (double)a[3 + c] + (double)b[3 + c];
            }
        image_release(&half[0]), image_release(&half[1]);
    }
    print_message("variance %.2f of that of independent samples\n", square / stated);
    assert_true(square > 0.05 * stated && square < 0.9 * stated);
    scene_free(scene);
}

/* A picture of half as many lines shows the same crop: each of its pixels is the mean of two, within their variances,
 * which are stated too large. */
static void half_as_many_lines(void **state)
{
    (void)state;
    struct scene *scene = small_cloth(true);
    struct configuration near = configuration[1];
    struct render_request q = request(scene, &near);
    struct image low, high;
    double chi2 = 0, n = 0;
    q.input.want_derivative = false;
    q.input.n_hit = 1;
    q.n_sample = 64;
    near.crop_m = 2e-4; /* some fibers */
    q.height = 24;
    render_fixture_run(&q, 2, &high);
    q.height = 12;
    q.stream = 1;
    render_fixture_run(&q, 2, &low);
    for (size_t i = 0; i < low.width * low.height; i++) {
        const size_t above = i % low.width + 2 * (i / low.width) * low.width;
        const float *a = low.pixel + i * low.n_channel, *b = high.pixel + above * high.n_channel,
                    *c = b + high.width * high.n_channel;
        const double off = (double)a[1] - 0.5 * ((double)b[1] + (double)c[1]),
                     var = (double)a[4] + 0.25 * ((double)b[4] + (double)c[4]);
        if (!(var > 0)) continue;
        chi2 += off * off / var;
        n++;
    }
    print_message("chi-square %.2f for each of %.0f pixels\n", chi2 / n, n);
    assert_true(n > 30 && chi2 < n + 4 * sqrt(2 * n));
    image_release(&low), image_release(&high);
    scene_free(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(layers_and_threads),
        cmocka_unit_test(agrees_with_estimate),
        cmocka_unit_test(variance_is_that_of_the_mean),
        cmocka_unit_test(back_light),
        cmocka_unit_test(bad_requests),
        cmocka_unit_test(samples_lie_evenly),
        cmocka_unit_test(half_as_many_lines),
    };
    return cmocka_run_group_tests(tests, set_up, NULL);
}
