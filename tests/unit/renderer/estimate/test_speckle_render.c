/* Pictures with speckle: their mean over patterns is that of the picture without, a seed makes the same bits for any
 * number of threads, and what has no speckle says so. */
#include "renderer/estimate/estimate.h"
#include "renderer/estimate/render.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/statistics_test.h"
#include "tests/support/tracer/estimate_fixture.h"
#include "tests/support/tracer/orbit_configurations.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { PX = 16, N_SAMPLE = 8 };

static double start[SCATTERING_MAX_PARAM];
static struct appearance model;
static struct configuration configuration[16];
static struct scene *scene;

static int set_up(void **state)
{
    (void)state;
    struct fiber_set f;
    const struct scattering_model *m = scattering_find("wave_silk.v2");
    for (size_t p = 0; p < m->n_param; p++) start[p] = m->param[p].start;
    orbit_configurations_16(configuration);
    hand_weave_small(&f);
    const status st = scene_new(&f, &(struct scene_option){.black_sheet = true}, &scene, NULL);
    fiber_set_release(&f);
    return st != STATUS_OK;
}

static int tear_down(void **state)
{
    (void)state;
    scene_free(scene);
    return 0;
}

static struct render_request request(const struct configuration *c)
{
    return (struct render_request){.input = trace_input_surface(scene, scattering_find("wave_silk.v2"), start, &model),
                                   .configuration = c,
                                   .width = PX,
                                   .height = PX,
                                   .n_sample = N_SAMPLE,
                                   .seed = 5};
}

static double mean_of(const struct image *im, size_t channel)
{
    double sum = 0;
    for (size_t i = 0; i < PX * PX; i++) sum += (double)im->pixel[i * im->n_channel + channel] / (PX * PX);
    return sum;
}

/* The paths are the same with and without speckle, so their noise is not in the difference. What is left is that of
 * the patterns, which the spread over seeds tells. Under a lamp, and under an even sky, whose light ends the walks. */
static void the_mean_stays(void **state)
{
    enum { N_SEED = 32 };
    (void)state;
    for (int sky = 0; sky < 2; sky++) {
        struct configuration c = configuration[3];
        if (sky == 1) {
            c.light = LIGHT_NO_LAMP;
            for (int k = 0; k < 3; k++) c.environment_rgb[k] = 1;
        }
        struct render_request q = request(&c);
        struct image plain, with;
        struct sample_mean off[3] = {0};
        render_fixture_run(&q, 1, &plain);
        for (uint64_t seed = 0; seed < N_SEED; seed++) {
            q.input.has_speckle = true;
            q.input.speckle_seed = seed;
            render_fixture_run(&q, 1, &with);
            for (size_t k = 0; k < 3; k++) sample_mean_add(&off[k], mean_of(&with, k) / mean_of(&plain, k) - 1);
            image_release(&with);
        }
        for (int k = 0; k < 3; k++) {
            const double se = sample_mean_se(&off[k]);
            assert_true(se > 1e-5 && se < 0.05);
            assert_true(fabs(off[k].mean) < 4 * se);
        }
        image_release(&plain);
    }
}

static void a_seed_makes_the_same_picture(void **state)
{
    (void)state;
    struct render_request q = request(&configuration[2]);
    struct image plain, one, two, other, without;
    const size_t n_byte = PX * PX * 6 * sizeof(float);
    render_fixture_run(&q, 1, &plain);
    q.input.has_speckle = true;
    q.input.speckle_seed = 4;
    render_fixture_run(&q, 1, &one);
    render_fixture_run(&q, 2, &two);
    q.input.speckle_seed = 5;
    render_fixture_run(&q, 1, &other);
    q.input.has_speckle = false;
    render_fixture_run(&q, 1, &without);
    assert_memory_equal(one.pixel, two.pixel, n_byte);
    assert_memory_equal(plain.pixel, without.pixel, n_byte);
    assert_true(memcmp(one.pixel, other.pixel, n_byte) != 0 && memcmp(one.pixel, plain.pixel, n_byte) != 0);
    image_release(&plain), image_release(&one), image_release(&two), image_release(&other), image_release(&without);
}

/* The pattern is seen: pixels differ by more than they do without it. */
static void the_picture_has_more_contrast(void **state)
{
    (void)state;
    struct render_request q = request(&configuration[1]);
    struct image plain, with;
    double spread[2] = {0}, mean = 0;
    q.n_sample = 64;
    render_fixture_run(&q, 2, &plain);
    q.input.has_speckle = true;
    render_fixture_run(&q, 2, &with);
    mean = mean_of(&plain, 1);
    for (size_t i = 0; i < PX * PX; i++) {
        spread[0] += pow((double)plain.pixel[i * plain.n_channel + 1] - mean, 2);
        spread[1] += pow((double)with.pixel[i * with.n_channel + 1] - mean, 2);
    }
    assert_true(spread[1] > 1.1 * spread[0]);
    image_release(&plain), image_release(&with);
}

static void what_has_none_says_so(void **state)
{
    (void)state;
    struct render_request q = request(&configuration[1]);
    struct image im;
    struct error err = {0};
    q.input.has_speckle = true;
    q.input.want_derivative = true;
    assert_int_equal(render_run(&q, NULL, NULL, &im, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "speckle"));
    const size_t n_path = 16;
    struct estimate e;
    const struct estimate_request fit = {
        .input = q.input, .configuration = q.configuration, .n_configuration = 1, .n_path = &n_path};
    assert_int_equal(estimate_run(&fit, NULL, NULL, &e, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "speckle"));
    q.input = trace_input_surface(scene, scattering_find("isotropic.v1"), start, &model);
    q.input.has_speckle = true;
    assert_int_equal(render_run(&q, NULL, NULL, &im, &err), STATUS_INVALID);
    assert_string_equal(err.field, "model");
    assert_non_null(strstr(err.text, "isotropic.v1"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_mean_stays),
        cmocka_unit_test(a_seed_makes_the_same_picture),
        cmocka_unit_test(the_picture_has_more_contrast),
        cmocka_unit_test(what_has_none_says_so),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
