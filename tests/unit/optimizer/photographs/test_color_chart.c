/* Published color differences, and ColorCheckers: drawn, warped and unevenly lit here, and a real one
 * (data/color-target). */
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/photographs/camera/color_chart.h"
#include "optimizer/photographs/camera/color_matrix.h"
#include "optimizer/photographs/reader/photograph.h"
#include "tests/support/drawn_chart.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const double camera[9] = {0.61, 0.22, 0.05, 0.11, 0.74, 0.09, 0.02, 0.18, 0.48}; /* radiance to camera rgb */

/* The neutral patches are nearly grey, their luminances those of Munsell values 9.5 to 2. */
static void test_reference(void **state)
{
    static const double luminance[6] = {0.913, 0.589, 0.362, 0.191, 0.089, 0.031};
    (void)state;
    for (size_t i = 0; i < 6; i++) {
        double rgb[3];
        color_chart_reference(false, 18 + i, rgb);
        for (size_t c = 0; c < 3; c++) assert_true(fabs(rgb[c] / luminance[i] - 1.0) < 0.06);
    }
    double red[3], later[3], white[3];
    color_chart_reference(true, 18, later); /* colour-science 0.4.7: XYZ of L* 95.19 against L* 96.539 */
    color_chart_reference(false, 18, white);
    assert_true(fabs(later[1] / white[1] - 0.8808 / 0.9135) < 0.01);
    for (size_t i = 0; i < 24; i++) {
        double before[3], after[3];
        color_chart_reference(false, i, before);
        color_chart_reference(true, i, after);
        for (size_t c = 0; c < 3; c++) assert_true(fabs(after[c] - before[c]) < 0.1);
    }
    color_chart_reference(false, 14, red);
    assert_true(red[0] > 5.0 * red[1] && red[0] > 4.0 * red[2]);
}

static void test_delta_e(void **state)
{
    const double white[3] = {1, 1, 1}, grey[3] = {0.5, 0.5, 0.5}, blue[3] = {0.1, 0.1, 0.5},
                 purple[3] = {0.12, 0.1, 0.5};
    (void)state;
    assert_true(color_delta_e_2000(grey, grey) == 0.0);
    /* L* 100 and 76.0693: dL over S_L at the mean 88.0346 */
    double l = 76.0692610, mean = 0.5 * (100.0 + l) - 50.0, sl = 1.0 + 0.015 * mean * mean / sqrt(20.0 + mean * mean);
    assert_true(fabs(color_delta_e_2000(white, grey) - (100.0 - l) / sl) < 1e-4);
    assert_true(fabs(color_delta_e_2000(blue, purple) - color_delta_e_2000(purple, blue)) < 1e-9);
    assert_true(color_delta_e_2000(blue, purple) > 0.5 && color_delta_e_2000(blue, purple) < 6.0);
}

/* ---- drawn charts ---- */

static void check_matrix(const struct color_chart *k, double gain, double tolerance)
{
    for (size_t i = 0; i < 24; i++) {
        double rgb[3], out[3];
        color_chart_reference(false, i, rgb);
        color_matrix_apply(camera, rgb, out);
        for (size_t c = 0; c < 3; c++) out[c] *= gain;
        color_matrix_apply(k->fit.matrix, out, out);
        for (size_t c = 0; c < 3; c++)
            if (!(fabs(out[c] - rgb[c]) < tolerance))
                fail_msg("patch %zu, channel %zu: %g, not %g", i, c, out[c], rgb[c]);
    }
}

static void test_drawn_charts(void **state)
{
    static const double corner[3][8] = {
        {150, 120, 650, 120, 650, 450, 150, 450},
        {180, 100, 640, 160, 600, 480, 130, 400}, /* tilted */
        {600, 470, 160, 440, 190, 130, 620, 150}, /* upside down */
    };
    (void)state;
    for (size_t i = 0; i < 3; i++) {
        struct image im;
        struct color_chart k = {.scale_at_px = {NAN, NAN}};
        struct error err = {0};
        assert_int_equal(image_init(&im, 800, 600, 3, NULL), STATUS_OK);
        draw_chart(&im, corner[i], camera, 300.0, i == 2 ? 0.02 : 0.0);
        for (int given = 0; given < 2; given++) {
            for (size_t c = 0; c < 8; c++) k.corner_px[c] = given ? corner[i][c] : NAN;
            if (color_chart_find(&im, k.corner_px, &k.found_automatically, &err) != STATUS_OK)
                fail_msg("%zu: %s", i, err.text);
            assert_true(k.found_automatically == !given);
            for (size_t c = 0; c < 8; c++)
                if (fabs(k.corner_px[c] - corner[i][c]) > 8.0)
                    fail_msg("%zu: corner %zu at %g, not %g", i, c, k.corner_px[c], corner[i][c]);
            if (color_chart_measure(&k, &im, INFINITY, 0.0, NULL, &err) != STATUS_OK) fail_msg("%s", err.text);
            check_matrix(&k, 300.0, i == 2 ? 6e-3 : 1e-6);
            assert_true(k.delta_e_before[2] > 2.0 && k.delta_e_after[2] < (i == 2 ? 0.5 : 1e-3));
        }
        image_release(&im);
    }
}

/* Light over the chart: linear terms, and a bend. */
static double light_at(const double place[2], double slope, double phi, double bend)
{
    return 1.0 + slope * (cos(phi) * place[0] + sin(phi) * place[1]) -
           bend * (place[0] * place[0] + place[1] * place[1]);
}

/* Multiplies a picture by a light that falls along a direction of the picture, from the middle of the corners. */
static void light_picture(struct image *im, double slope, double phi, double bend)
{
    for (size_t i = 0; i < im->width * im->height; i++) {
        const double place[2] = {((double)(i % im->width) - 400.0) / 250.0, ((double)(i / im->width) - 285.0) / 250.0};
        for (size_t c = 0; c < 3; c++) im->pixel[3 * i + c] *= (float)fmax(0.05, light_at(place, slope, phi, bend));
    }
}

struct heard {
    char text[4][600];
    size_t n;
};

static void hear(void *context, const char *option, const char *text)
{
    struct heard *h = context;
    assert_string_equal(option, "color_chart");
    snprintf(h->text[h->n++ % 4], sizeof h->text[0], "%s", text);
}

/* Lamps that fall by 0 to 30 % over the chart in any direction, also warm and cold ones, with a patch saturated, and
 * charts upside down: the matrix is right in the middle of the chart, and the fall is told from 10 % on. */
static void test_fall_of_light(void **state)
{
    static const double corner[2][8] = {{150, 120, 650, 120, 650, 450, 150, 450},
                                        {650, 450, 150, 450, 150, 120, 650, 120}};
    static const double lamp[3][3] = {{1, 1, 1}, {1.6, 1, 0.5}, {0.7, 1, 1.5}};
    (void)state;
    for (size_t t = 0; t < 12; t++) {
        const double fall = 0.3 * (double)t / 11.0, slope = fall / (2.0 - fall);
        double tinted[9];
        struct image im;
        struct color_chart k = {.scale_at_px = {NAN, NAN}};
        struct heard heard = {.n = 0};
        struct error err = {0};
        for (size_t j = 0; j < 9; j++) tinted[j] = camera[j] * lamp[t % 3][j / 3];
        assert_int_equal(image_init(&im, 800, 600, 3, NULL), STATUS_OK);
        draw_chart(&im, corner[t % 2], tinted, 1.0, 0.01);
        light_picture(&im, slope, 0.6 * (double)t, t > 8 ? 0.04 : 0.0);
        memcpy(k.corner_px, corner[t % 2], sizeof k.corner_px);
        for (size_t y = 200; y < 290 && t == 4; y++) /* the orange patch is saturated */
            for (size_t x = 145; x < 230; x++) im.pixel[3 * (800 * y + x)] = 5.0f;
        if (color_chart_measure(&k, &im, 5.0, 0.0, &(struct warning_sink){hear, &heard}, &err) != STATUS_OK)
            fail_msg("%zu: %s", t, err.text);
        assert_true(k.saturated[6] == (t == 4) && k.white == 18);
        for (size_t i = 0; i < 24; i++) {
            double rgb[3], out[3], error[3][COLOR_MATRIX_CAUSES];
            color_chart_reference(false, i, rgb);
            color_matrix_apply(tinted, rgb, out);
            color_matrix_error(k.fit.cov, out, error);
            color_matrix_apply(k.fit.matrix, out, out);
            for (size_t c = 0; c < 3; c++) {
                double var = 0.0;
                for (size_t e = 0; e < COLOR_MATRIX_CAUSES; e++) var += error[c][e] * error[c][e];
                if (fabs(out[c] - rgb[c]) > 0.005 || fabs(out[c] - rgb[c]) > 4.5 * sqrt(var))
                    fail_msg("fall %g, patch %zu, channel %zu: %g +- %g, not %g", fall, i, c, out[c], sqrt(var),
                             rgb[c]);
            }
        }
        assert_true(heard.n == (k.light_range > 0.1) && (heard.n == 0 || strstr(heard.text[0], "falls by") != NULL));
        if (fall > 0.13) assert_true(heard.n == 1);
        image_release(&im);
    }
}

/* A chart with other colors: refused with the worst patch by name. One that is a little different warns. */
static void test_other_charts(void **state)
{
    const double corner[8] = {150, 120, 650, 120, 650, 450, 150, 450};
    struct image im;
    struct error err = {0};
    (void)state;
    for (int strong = 0; strong < 2; strong++) {
        struct color_chart k = {.scale_at_px = {NAN, NAN}};
        struct heard heard = {.n = 0};
        assert_int_equal(image_init(&im, 800, 600, 3, NULL), STATUS_OK);
        draw_chart(&im, corner, camera, 1.0, 0.0);
        for (size_t i = 0; i < 800 * 600; i++) { /* other pigments in every other column of patches */
            const size_t column = i % 800 > 150 ? (i % 800 - 150) * 6 / 500 : 0;
            if (column % 2 == 1) im.pixel[3 * i] *= strong ? 2.0f : 1.35f;
        }
        memcpy(k.corner_px, corner, sizeof corner);
        status s = color_chart_measure(&k, &im, INFINITY, 0.0, &(struct warning_sink){hear, &heard}, &err);
        assert_int_equal(s, strong ? STATUS_INVALID : STATUS_OK);
        print_message("%g, worst %s\n", color_chart_mean(k.delta_e_left_out), color_chart_patch_name(k.worst));
        if (strong && (strstr(err.text, "not those of a ColorChecker") == NULL ||
                       strstr(err.text, color_chart_patch_name(k.worst)) == NULL))
            fail_msg("%s", err.text);
        if (!strong && (heard.n == 0 || strstr(heard.text[0], "(CIEDE2000) in the mean") == NULL))
            fail_msg("no warning");
        image_release(&im);
    }
}

/* Measures a drawn chart of before November 2014, one patch of which is darker, and returns the warnings about it. */
static struct heard warnings_of(bool from_2014, float light_of_red)
{
    static const double corner[8] = {150, 120, 650, 120, 650, 450, 150, 450};
    struct color_chart k = {.from_2014 = from_2014, .scale_at_px = {NAN, NAN}};
    struct heard heard = {.n = 0};
    struct image im;
    assert_int_equal(image_init(&im, 800, 600, 3, NULL), STATUS_OK);
    draw_chart(&im, corner, camera, 1.0, 0.002);
    for (size_t i = 0; i < 3 * 800 * 600; i++) { /* red is the third patch of the third row */
        const size_t x = i / 3 % 800, y = i / 3 / 800;
        if (x > 315 && x < 395 && y > 285 && y < 365) im.pixel[i] *= light_of_red;
    }
    memcpy(k.corner_px, corner, sizeof corner);
    assert_int_equal(color_chart_measure(&k, &im, INFINITY, 0.0, &(struct warning_sink){hear, &heard}, NULL),
                     STATUS_OK);
    image_release(&im);
    return heard;
}

/* The other edition's colors, which fit better, and a single patch that is off are named; a right chart is silent. */
static void test_single_doubts(void **state)
{
    (void)state;
    assert_int_equal(warnings_of(false, 1.0f).n, 0);
    const struct heard edition = warnings_of(true, 1.0f), shadow = warnings_of(false, 0.5f);
    assert_int_equal(edition.n, 1);
    assert_non_null(strstr(edition.text[0], "a chart made before November 2014 fit better"));
    assert_int_equal(shadow.n, 1);
    assert_non_null(strstr(shadow.text[0], "patch 'red' of the color chart differs by"));
}

/* The same picture gives the same corners, to the last bit, however the machine shares its cores. */
static void test_same_chart_again(void **state)
{
    static const double corner[8] = {150, 120, 650, 120, 650, 450, 150, 450};
    double first[8] = {NAN};
    struct image im;
    bool found;
    (void)state;
    assert_int_equal(image_init(&im, 800, 600, 3, NULL), STATUS_OK);
    draw_chart(&im, corner, camera, 300.0, 0.0);
    assert_int_equal(color_chart_find(&im, first, &found, NULL), STATUS_OK);
    for (int i = 0; i < 10; i++) {
        double again[8] = {NAN};
        assert_int_equal(color_chart_find(&im, again, &found, NULL), STATUS_OK);
        assert_memory_equal(again, first, sizeof first);
    }
    image_release(&im);
}

static void test_refused_charts(void **state)
{
    const double corner[8] = {150, 120, 650, 120, 650, 450, 150, 450};
    struct image im, picture;
    struct color_chart k = {.scale_at_px = {NAN, NAN}};
    struct error err = {0};
    (void)state;
    assert_int_equal(image_init(&im, 800, 600, 3, NULL), STATUS_OK);
    draw_chart(&im, corner, camera, 1.0, 0.0);
    memcpy(k.corner_px, corner, sizeof corner);
    assert_int_equal(color_chart_measure(&k, &im, INFINITY, 1.0, NULL, &err), STATUS_OK);
    assert_true(fabs(k.wanted_rgb[18][1] / cos(1.0) - 0.913) < 0.01); /* a tilted lamp */
    assert_int_equal(color_chart_picture(&k, &im, &picture, &err), STATUS_OK);
    double want[3];
    color_chart_reference(false, 18, want);
    const float *p = picture.pixel + 3 * (picture.width * (picture.height - 5) + 5);
    for (size_t c = 0; c < 3; c++) assert_true(fabs((double)p[c] - want[c] * cos(1.0)) < 1e-5);
    image_release(&picture);
    assert_int_equal(color_chart_measure(&k, &im, 0.5, 0.0, NULL, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "white patch is saturated"));
    memcpy(k.corner_px, (double[8]){650, 120, 650, 450, 150, 450, 150, 120}, sizeof corner);
    assert_int_equal(color_chart_measure(&k, &im, INFINITY, 0.0, NULL, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "order of the corners"));
    memcpy(k.corner_px, (double[8]){150, 120, 950, 120, 950, 450, 150, 450}, sizeof corner);
    assert_int_equal(color_chart_measure(&k, &im, INFINITY, 0.0, NULL, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "outside of the picture"));
    for (size_t i = 0; i < 800 * 600 * 3; i++) im.pixel[i] = 0.3f;
    k.corner_px[0] = NAN;
    assert_int_equal(color_chart_find(&im, k.corner_px, &k.found_automatically, &err), STATUS_NOT_FOUND);
    image_release(&im);
}

/* pedrodiamel/colorchecker-detection: a ColorChecker beside red and white cloth, part of the scene in shadow. */
static void test_real_chart(void **state)
{
    char path[4096];
    const char *data = getenv("SELVEDGE_DATA");
    const struct job_photograph p = photograph_plain(JOB_TRANSFER_SRGB);
    struct image im;
    struct color_chart k = {.corner_px = {NAN}, .scale_at_px = {NAN, NAN}};
    struct error err = {0};
    (void)state;
    snprintf(path, sizeof path, "%s/color-target/img-colorchecker_3.5MB.jpg", data != NULL ? data : "../shared/data");
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        printf("skipped: no %s\n", path);
        skip();
    }
    fclose(file);
    if (photograph_read(path, &p, &im, NULL, &err) != STATUS_OK) fail_msg("%s", err.text);
    if (color_chart_find(&im, k.corner_px, &k.found_automatically, &err) != STATUS_OK) fail_msg("%s", err.text);
    if (color_chart_measure(&k, &im, INFINITY, 0.0, NULL, &err) != STATUS_OK) fail_msg("%s", err.text);
    const double before = color_chart_mean(k.delta_e_before), after = color_chart_mean(k.delta_e_after);
    print_message("left out %.2f, worst %s %.2f, light %.2f, matrix used %d\n", color_chart_mean(k.delta_e_left_out),
                  color_chart_patch_name(k.worst), k.delta_e_left_out[k.worst], k.light_range, k.matrix_used);
    printf("corners %.0f,%.0f %.0f,%.0f %.0f,%.0f %.0f,%.0f; CIEDE2000 %.2f before, %.2f after\n", k.corner_px[0],
           k.corner_px[1], k.corner_px[2], k.corner_px[3], k.corner_px[4], k.corner_px[5], k.corner_px[6],
           k.corner_px[7], before, after);
    assert_true(after < before && after < 8.0);
    const char *out = getenv("CHART_PICTURE");
    struct image picture;
    if (out != NULL && color_chart_picture(&k, &im, &picture, NULL) == STATUS_OK) {
        image_write_png(&picture, 1.0, out, NULL);
        image_release(&picture);
    }
    image_release(&im);
}

int main(void)
{
    const struct CMUnitTest tests[] = {

        cmocka_unit_test(test_reference),      cmocka_unit_test(test_delta_e),
        cmocka_unit_test(test_drawn_charts),   cmocka_unit_test(test_same_chart_again),
        cmocka_unit_test(test_refused_charts), cmocka_unit_test(test_fall_of_light),
        cmocka_unit_test(test_other_charts),   cmocka_unit_test(test_single_doubts),
        cmocka_unit_test(test_real_chart),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
