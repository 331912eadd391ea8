/* The joint filter for previews: what it does to noise, to edges of features and of colors, and to a picture without
 * noise; and on a rendering against one of many samples. */
#include "base/rng.h"
#include "renderer/estimate/render.h"
#include "renderer/preview/feature_image.h"
#include "renderer/preview/joint_filter.h"
#include "tests/support/cloth/dual_cloth.h"
#include "tests/support/tracer/orbit_configurations.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { EDGE = 48 };

/* A picture of radiance left and right of its middle with noise of a standard deviation, and features to it: the normal
 * turns at the middle if `turned`. */
static void make(double left, double right, double sd, bool turned, struct image *picture, struct image *feature)
{
    struct rng rng;
    rng_start(&rng, &(struct rng_key){.seed = 2}, 0, 0);
    assert_int_equal(image_init(picture, EDGE, EDGE, 6, NULL), STATUS_OK);
    assert_int_equal(image_init(feature, EDGE, EDGE, (size_t)2 * N_FEATURE, NULL), STATUS_OK);
    for (size_t i = 0; i < EDGE * EDGE; i++) {
        bool second = i % EDGE >= EDGE / 2;
        float *f = feature->pixel + i * 2 * N_FEATURE;
        for (int c = 0; c < 3; c++) {
            double normal[2];
            rng_normal_pair(&rng, normal);
            picture->pixel[6 * i + (size_t)c] = (float)((second ? right : left) + sd * normal[0]);
            picture->pixel[6 * i + 3 + (size_t)c] = (float)(sd * sd);
            f[FEATURE_ALBEDO + c] = 0.8f;
        }
        f[FEATURE_NORMAL + (turned && second ? 0 : 2)] = 1;
    }
}

/* Mean and standard deviation of red in columns [from, to). */
static void moments(const struct image *im, size_t from, size_t to, double *mean, double *sd)
{
    double sum = 0, square = 0, n = 0;
    for (size_t i = 0; i < EDGE * EDGE; i++) {
        double v = (double)im->pixel[i * im->n_channel];
        if (i % EDGE < from || i % EDGE >= to) continue;
        n++;
        sum += v;
        square += v * v;
    }
    *mean = sum / n;
    *sd = sqrt(fmax(0, square / n - *mean * *mean));
}

static void noise_falls_and_the_mean_stays(void **state)
{
    (void)state;
    struct image picture, feature, out;
    double mean, sd;
    make(1, 1, 0.3, false, &picture, &feature);
    assert_int_equal(joint_filter(&picture, &feature, NULL, NULL, &out, NULL), STATUS_OK);
    moments(&out, 0, EDGE, &mean, &sd);
    print_message("noise 0.3 becomes %.4f, the mean %.4f\n", sd, mean);
    assert_true(fabs(mean - 1) < 0.02 && sd < 0.08);
    image_release(&picture), image_release(&feature), image_release(&out);
}

/* An edge that is lower than the noise is kept where the normals turn, and lost where nothing tells of it. */
static void features_keep_edges(void **state)
{
    (void)state;
    for (int turned = 0; turned < 2; turned++) {
        struct image picture, feature, out;
        double left, right, sd;
        make(1, 1.2, 0.3, turned != 0, &picture, &feature);
        assert_int_equal(joint_filter(&picture, &feature, NULL, NULL, &out, NULL), STATUS_OK);
        moments(&out, EDGE / 2 - 1, EDGE / 2, &left, &sd);
        moments(&out, EDGE / 2, EDGE / 2 + 1, &right, &sd);
        print_message("an edge of 0.2 becomes %.3f\n", right - left);
        assert_true(turned != 0 ? fabs(right - left - 0.2) < 0.08 : right - left < 0.1);
        image_release(&picture), image_release(&feature), image_release(&out);
    }
}

/* Colors that differ by much more than their noise do not mix, and without noise nothing changes. */
static void certain_pixels_stay(void **state)
{
    (void)state;
    struct image picture, feature, out;
    double left, right, sd;
    make(1, 3, 0.1, false, &picture, &feature);
    assert_int_equal(joint_filter(&picture, &feature, NULL, NULL, &out, NULL), STATUS_OK);
    moments(&out, EDGE / 2 - 1, EDGE / 2, &left, &sd);
    moments(&out, EDGE / 2, EDGE / 2 + 1, &right, &sd);
    assert_true(fabs(left - 1) < 0.1 && fabs(right - 3) < 0.1);
    image_release(&picture), image_release(&feature), image_release(&out);
    make(1, 3, 0, false, &picture, &feature);
    assert_int_equal(joint_filter(&picture, &feature, NULL, NULL, &out, NULL), STATUS_OK);
    for (size_t i = 0; i < EDGE * EDGE; i++) assert_true(fabsf(out.pixel[3 * i] - picture.pixel[6 * i]) < 1e-5f);
    image_release(&picture), image_release(&feature), image_release(&out);
}

static double error_of(const struct image *im, const struct image *reference)
{
    double sum = 0, mean = 0;
    for (size_t i = 0; i < im->width * im->height; i++)
        for (size_t c = 0; c < 3; c++) {
            double r = (double)reference->pixel[i * reference->n_channel + c];
            sum += pow((double)im->pixel[i * im->n_channel + c] - r, 2);
            mean += r;
        }
    return sqrt(sum / (double)(3 * im->width * im->height)) / (mean / (double)(3 * im->width * im->height));
}

/* A weave by 4 samples a pixel is nearer to one by 512 samples after the filter; threads do not change its bits. */
static void a_rendering_comes_nearer(void **state)
{
    (void)state;
    struct dual_cloth c;
    struct appearance model;
    struct configuration view[16];
    struct image few, many, feature, out, again;
    struct error err = {0};
    struct thread_pool *pool;
    dual_cloth_weave(&c, 0, dual_cloth_wide);
    orbit_configurations_16(view);
    view[1].crop_m = 6e-3;
    assert_int_equal(thread_pool_new(2, &pool, &err), STATUS_OK);
    struct render_request q = {.input = trace_input_surface(c.scene, c.model, c.param, &model),
                               .configuration = &view[1],
                               .width = 64,
                               .height = 64,
                               .n_sample = 4,
                               .seed = 3};
    const struct feature_request f = {c.scene, &c.tables, &view[1], 64, 64, 16, 3};
    if (render_run(&q, pool, NULL, &few, &err) != STATUS_OK) fail_msg("%s", err.text);
    q.n_sample = 512;
    q.stream = 1;
    if (render_run(&q, pool, NULL, &many, &err) != STATUS_OK) fail_msg("%s", err.text);
    if (feature_image_render(&f, pool, NULL, &feature, &err) != STATUS_OK) fail_msg("%s", err.text);
    if (joint_filter(&few, &feature, pool, NULL, &out, &err) != STATUS_OK) fail_msg("%s", err.text);
    if (joint_filter(&few, &feature, NULL, NULL, &again, &err) != STATUS_OK) fail_msg("%s", err.text);
    double before = error_of(&few, &many), after = error_of(&out, &many);
    print_message("error of pixels: %.3f, filtered %.3f\n", before, after);
    assert_true(after < 0.75 * before);
    assert_memory_equal(out.pixel, again.pixel, 64 * 64 * 3 * sizeof(float));
    image_release(&few), image_release(&many), image_release(&feature), image_release(&out), image_release(&again);
    thread_pool_free(pool);
    dual_cloth_release(&c);
}

/* Features of the weave: its albedo is that of its parameters, its normals point to the camera's side. */
static void features_of_a_weave(void **state)
{
    (void)state;
    struct dual_cloth c;
    struct configuration view[16];
    struct image feature;
    struct error err = {0};
    dual_cloth_weave(&c, 0.6, NULL);
    orbit_configurations_16(view);
    struct feature_request f = {c.scene, &c.tables, &view[0], 32, 32, 16, 3};
    if (feature_image_render(&f, NULL, NULL, &feature, &err) != STATUS_OK) fail_msg("%s", err.text);
    double albedo = 0, up = 0;
    for (size_t i = 0; i < 32 * 32; i++) {
        albedo += (double)feature.pixel[i * 2 * N_FEATURE + FEATURE_ALBEDO] / 1024;
        up += (double)feature.pixel[i * 2 * N_FEATURE + FEATURE_NORMAL + 2] / 1024;
    }
    assert_true(albedo > 0.4 && albedo < 0.601 && up > 0.4); /* gaps see nothing */
    image_release(&feature);
    f.n_sample = 1;
    assert_int_equal(feature_image_render(&f, NULL, NULL, &feature, &err), STATUS_INVALID);
    dual_cloth_release(&c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(noise_falls_and_the_mean_stays),
        cmocka_unit_test(features_keep_edges),
        cmocka_unit_test(certain_pixels_stay),
        cmocka_unit_test(a_rendering_comes_nearer),
        cmocka_unit_test(features_of_a_weave),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
