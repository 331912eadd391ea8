/* The joint filter for previews: what it does to noise, to edges of features and of colors, and to a picture without
 * noise; and on a rendering against one of many samples. */
#include "base/rng.h"
#include "renderer/estimate/render.h"
#include "renderer/estimate/render_guides.h"
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

enum { EDGE = 48, N_PIXEL = EDGE * EDGE };

/* Two halves of a picture, each with noise of a standard deviation, and what guides the filter. */
struct scene_picture {
    struct image half[2], early, feature;
};

/* Radiance left and right of the middle; the normal turns at the middle if `turned`. early: every fourth column has 1
 * more, which the early light says. */
static void make(double left, double right, double sd, bool turned, bool early, struct scene_picture *p)
{
    struct rng rng;
    rng_start(&rng, &(struct rng_key){.seed = 2}, 0, 0);
    for (int h = 0; h < 2; h++) assert_int_equal(image_init(&p->half[h], EDGE, EDGE, 6, NULL), STATUS_OK);
    assert_int_equal(image_init(&p->early, EDGE, EDGE, 6, NULL), STATUS_OK);
    assert_int_equal(image_init(&p->feature, EDGE, EDGE, (size_t)2 * N_FEATURE, NULL), STATUS_OK);
    for (size_t i = 0; i < N_PIXEL; i++) {
        bool second = i % EDGE >= EDGE / 2;
        float *f = p->feature.pixel + i * 2 * N_FEATURE;
        for (size_t c = 0; c < 3; c++) {
            double normal[2], more = early && i % 4 == 0 ? 1 : 0;
            rng_normal_pair(&rng, normal);
            p->early.pixel[6 * i + c] = (float)more;
            for (int h = 0; h < 2; h++)
                p->half[h].pixel[6 * i + c] = (float)((second ? right : left) + more + sd * normal[h]);
            f[FEATURE_ALBEDO + c] = 0.8f;
        }
        f[FEATURE_NORMAL + (turned && second ? 0 : 2)] = 1;
        f[FEATURE_SEEN] = 1;
    }
}

static void release(struct scene_picture *p)
{
    image_release(&p->half[0]), image_release(&p->half[1]), image_release(&p->early), image_release(&p->feature);
}

static void filter(const struct scene_picture *p, struct image *out, double *error)
{
    const struct joint_input in = {{&p->half[0], &p->half[1]}, &p->early, &p->feature};
    struct error err = {0};
    if (joint_filter(&in, NULL, NULL, out, error, &err) != STATUS_OK) fail_msg("%s", err.text);
}

/* Mean and standard deviation of red in columns [from, to). */
static void moments(const struct image *im, size_t from, size_t to, double *mean, double *sd)
{
    double sum = 0, square = 0, n = 0;
    for (size_t i = 0; i < N_PIXEL; i++) {
        double v = (double)im->pixel[i * im->n_channel];
        if (i % EDGE < from || i % EDGE >= to) continue;
        n++;
        sum += v;
        square += v * v;
    }
    *mean = sum / n;
    *sd = sqrt(fmax(0, square / n - *mean * *mean));
}

/* The error that is stated is that of the picture. */
static void noise_falls_and_the_mean_stays(void **state)
{
    (void)state;
    struct scene_picture p;
    struct image out;
    double mean, sd, error;
    make(1, 1, 0.3, false, false, &p);
    filter(&p, &out, &error);
    moments(&out, 0, EDGE, &mean, &sd);
    print_message("noise 0.3 of a half becomes %.4f, the mean %.4f; stated %.4f\n", sd, mean, error);
    assert_true(fabs(mean - 1) < 0.02 && sd < 0.06 && error < 0.06);
    release(&p), image_release(&out);
}

/* An edge that is lower than the noise is kept where the normals turn, and lost where nothing tells of it. */
static void features_keep_edges(void **state)
{
    (void)state;
    for (int turned = 0; turned < 2; turned++) {
        struct scene_picture p;
        struct image out;
        double left, right, sd, error;
        make(1, 1.2, 0.3, turned != 0, false, &p);
        filter(&p, &out, &error);
        moments(&out, EDGE / 2 - 1, EDGE / 2, &left, &sd);
        moments(&out, EDGE / 2, EDGE / 2 + 1, &right, &sd);
        print_message("an edge of 0.2 becomes %.3f\n", right - left);
        assert_true(turned != 0 ? fabs(right - left - 0.2) < 0.08 : right - left < 0.1);
        release(&p), image_release(&out);
    }
}

/* Light that is scattered a few times stays pixel by pixel, whatever noise lies over it. */
static void early_light_stays(void **state)
{
    (void)state;
    struct scene_picture p;
    struct image out;
    double error, worst = 0;
    make(0.5, 0.5, 0.3, false, true, &p);
    filter(&p, &out, &error);
    for (size_t i = 0; i < N_PIXEL; i++)
        worst = fmax(worst, fabs((double)out.pixel[3 * i] - 0.5 - (i % 4 == 0 ? 1.0 : 0.0)));
    print_message("a pixel is off by %.3f at most\n", worst);
    assert_true(worst < 0.25); /* without a filter 0.9 */
    release(&p), image_release(&out);
}

/* Colors that differ by much more than their noise do not mix, and without noise nothing changes. */
static void certain_pixels_stay(void **state)
{
    (void)state;
    struct scene_picture p;
    struct image out;
    double left, right, sd, error;
    make(1, 3, 0.1, false, false, &p);
    filter(&p, &out, &error);
    moments(&out, EDGE / 2 - 1, EDGE / 2, &left, &sd);
    moments(&out, EDGE / 2, EDGE / 2 + 1, &right, &sd);
    assert_true(fabs(left - 1) < 0.1 && fabs(right - 3) < 0.1);
    release(&p), image_release(&out);
    make(1, 3, 0, false, false, &p);
    filter(&p, &out, &error);
    for (size_t i = 0; i < N_PIXEL; i++) assert_true(fabsf(out.pixel[3 * i] - p.half[0].pixel[6 * i]) < 1e-3f);
    release(&p), image_release(&out);
}

static void pictures_of_other_sizes_are_refused(void **state)
{
    (void)state;
    struct scene_picture p;
    struct image out;
    struct error err = {0};
    double error;
    make(1, 1, 0.1, false, false, &p);
    image_release(&p.early);
    assert_int_equal(image_init(&p.early, EDGE, EDGE + 1, 6, NULL), STATUS_OK);
    const struct joint_input in = {{&p.half[0], &p.half[1]}, &p.early, &p.feature};
    assert_int_equal(joint_filter(&in, NULL, NULL, &out, &error, &err), STATUS_INVALID);
    release(&p);
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
    struct image half[2], both, many, out, again;
    struct render_guides guides;
    struct error err = {0};
    struct thread_pool *pool;
    double stated;
    dual_cloth_weave(&c, 0, dual_cloth_wide);
    orbit_configurations_16(view);
    view[1].crop_m = 6e-3;
    assert_int_equal(thread_pool_new(2, &pool, &err), STATUS_OK);
    struct render_request q = {.input = trace_input_surface(c.scene, c.model, c.param, &model),
                               .configuration = &view[1],
                               .width = 64,
                               .height = 64,
                               .n_sample = 2,
                               .seed = 3};
    for (int h = 0; h < 2; h++) {
        q.first_sample = 2 * (size_t)h;
        if (render_run(&q, pool, NULL, &half[h], &err) != STATUS_OK) fail_msg("%s", err.text);
    }
    q.first_sample = 0;
    q.n_sample = 4;
    if (render_run(&q, pool, NULL, &both, &err) != STATUS_OK) fail_msg("%s", err.text);
    if (render_guides_make(&q, &c.tables, pool, NULL, &guides, &err) != STATUS_OK) fail_msg("%s", err.text);
    if (render_guides_filter(&guides, half, pool, NULL, &out, &stated, &err) != STATUS_OK) fail_msg("%s", err.text);
    if (render_guides_filter(&guides, half, NULL, NULL, &again, &stated, &err) != STATUS_OK) fail_msg("%s", err.text);
    q.n_sample = 512;
    q.stream = 1;
    if (render_run(&q, pool, NULL, &many, &err) != STATUS_OK) fail_msg("%s", err.text);
    double before = error_of(&both, &many), after = error_of(&out, &many);
    print_message("error of pixels: %.3f, filtered %.3f, stated %.3f\n", before, after, stated);
    assert_true(after < 0.4 * before && stated > 0.4 * after && stated < 1.6 * after);
    assert_memory_equal(out.pixel, again.pixel, 64 * 64 * 3 * sizeof(float));
    render_guides_release(&guides);
    image_release(&half[0]), image_release(&half[1]), image_release(&both), image_release(&many), image_release(&out);
    image_release(&again);
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
    double across = 0, straight = 0, seen = 0;               /* fibers along x and y, seen at a slant */
    for (size_t i = 0; i < 32 * 32; i++) {
        const float *t = feature.pixel + i * 2 * N_FEATURE;
        across += hypot((double)t[FEATURE_TANGENT], (double)t[FEATURE_TANGENT + 1]) / 1024;
        straight += (double)t[FEATURE_TANGENT + 2] / 1024;
        seen += (double)t[FEATURE_SEEN] / 1024;
        assert_true(t[FEATURE_SEEN] <= 1 && t[FEATURE_TANGENT + 2] <= t[FEATURE_SEEN] + 1e-5f);
    }
    print_message("tangents: %.3f across the view, %.3f along it; %.3f of the pixels seen\n", across, straight, seen);
    assert_true(across > 0.2 && straight > 0.01 && seen > 0.5);
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
        cmocka_unit_test(early_light_stays),
        cmocka_unit_test(certain_pixels_stay),
        cmocka_unit_test(pictures_of_other_sizes_are_refused),
        cmocka_unit_test(a_rendering_comes_nearer),
        cmocka_unit_test(features_of_a_weave),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
