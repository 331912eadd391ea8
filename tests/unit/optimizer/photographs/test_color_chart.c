/* The color matrix on patches without noise, published color differences, and ColorCheckers: drawn and warped here, and
 * a real one (data/color-target). */
#include "base/rng.h"
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

static void test_matrix(void **state)
{
    double measured[24][3], wanted[24][3], matrix[9], product[9] = {0}, out[3];
    (void)state;
    for (size_t i = 0; i < 24; i++) {
        color_chart_reference(false, i, wanted[i]);
        color_matrix_apply(camera, wanted[i], measured[i]);
    }
    assert_int_equal(color_matrix_fit(24, (const double(*)[3])measured, (const double(*)[3])wanted, 18, matrix, NULL),
                     STATUS_OK);
    for (size_t i = 0; i < 27; i++)
        product[i / 9 * 3 + i % 3] += matrix[i / 9 * 3 + i / 3 % 3] * camera[i / 3 % 3 * 3 + i % 3];
    for (size_t i = 0; i < 9; i++) assert_true(fabs(product[i] - (i % 4 == 0 ? 1.0 : 0.0)) < 1e-6);
    for (size_t i = 0; i < 24; i++) /* noise: the white patch is matched all the same */
        for (size_t c = 0; c < 3; c++) measured[i][c] *= 1.0 + 0.05 * sin((double)(7 * i + 3 * c));
    assert_int_equal(color_matrix_fit(24, (const double(*)[3])measured, (const double(*)[3])wanted, 18, matrix, NULL),
                     STATUS_OK);
    color_matrix_apply(matrix, measured[18], out);
    for (size_t c = 0; c < 3; c++) assert_true(fabs(out[c] - wanted[18][c]) < 1e-9);
    for (size_t i = 0; i < 24; i++)
        for (size_t c = 0; c < 3; c++) measured[i][c] = 0.1 * (double)i + 0.1;
    assert_int_equal(color_matrix_fit(24, (const double(*)[3])measured, (const double(*)[3])wanted, 18, matrix, NULL),
                     STATUS_NUMERIC);
}

/* Radiance of one row of the matrix for a card, in one draw of the patches' noise, whose variance is proportional to
 * the light, and the variance that is stated. */
static double read_card(struct rng *rng, const double (*exact)[3], const double (*wanted)[3], const double card[3],
                        double *stated)
{
    double measured[24][3], var[24][3], matrix[9], cov[3][9], error[3], out[3], z[4];
    for (size_t i = 0; i < 24; i++) {
        rng_normal_pair(rng, z);
        rng_normal_pair(rng, z + 2);
        for (size_t c = 0; c < 3; c++) {
            var[i][c] = 1e-6 + 1e-4 * exact[i][c];
            measured[i][c] = exact[i][c] + sqrt(var[i][c]) * z[c];
        }
    }
    assert_int_equal(color_matrix_fit(24, (const double(*)[3])measured, wanted, 18, matrix, NULL), STATUS_OK);
    color_matrix_covariance(24, (const double(*)[3])measured, wanted, 18, matrix, (const double(*)[3])var, cov);
    color_matrix_apply(matrix, card, out);
    color_matrix_error(cov[0], card, error);
    *stated = error[0] * error[0] + error[1] * error[1] + error[2] * error[2];
    return out[0];
}

/* Stated errors of the matrix are the scatter over draws of noise that is stronger in bright patches, for a bright card
 * and for a dark one. With one variance for all patches that of the bright card would be too small. */
static void test_errors_of_the_matrix(void **state)
{
    enum { N_DRAW = 2000 };
    static const double card_rgb[2][3] = {{0.9, 0.3, 0.1}, {0.05, 0.06, 0.2}};
    double exact[24][3], wanted[24][3];
    (void)state;
    for (size_t i = 0; i < 24; i++) {
        color_chart_reference(false, i, wanted[i]);
        color_matrix_apply(camera, wanted[i], exact[i]);
    }
    for (size_t k = 0; k < 2; k++) {
        double card[3], mean = 0.0, square = 0.0, stated = 0.0;
        struct rng rng;
        rng_start(&rng, &(struct rng_key){.seed = 3 + k}, 0, 0);
        color_matrix_apply(camera, card_rgb[k], card);
        for (size_t draw = 0; draw < N_DRAW; draw++) {
            double var, value = read_card(&rng, (const double(*)[3])exact, (const double(*)[3])wanted, card, &var);
            mean += value / N_DRAW;
            square += value * value / N_DRAW;
            stated += var / N_DRAW;
        }
        double ratio = sqrt(stated / (square - mean * mean));
        print_message("card %zu: stated error over scatter %.3f\n", k, ratio);
        assert_true(ratio > 0.95 && ratio < 1.1);
    }
}

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
        color_matrix_apply(k->matrix, out, out);
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
        struct color_chart k = {0};
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
            if (color_chart_measure(&k, &im, INFINITY, 0.0, &err) != STATUS_OK) fail_msg("%s", err.text);
            check_matrix(&k, 300.0, i == 2 ? 6e-3 : 1e-6);
            assert_true(k.delta_e_before[2] > 2.0 && k.delta_e_after[2] < (i == 2 ? 0.5 : 1e-3));
        }
        image_release(&im);
    }
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
    struct color_chart k = {0};
    struct error err = {0};
    (void)state;
    assert_int_equal(image_init(&im, 800, 600, 3, NULL), STATUS_OK);
    draw_chart(&im, corner, camera, 1.0, 0.0);
    memcpy(k.corner_px, corner, sizeof corner);
    assert_int_equal(color_chart_measure(&k, &im, INFINITY, 1.0, &err), STATUS_OK);
    assert_true(fabs(k.wanted_rgb[18][1] / cos(1.0) - 0.913) < 0.01); /* a tilted lamp */
    assert_int_equal(color_chart_picture(&k, &im, &picture, &err), STATUS_OK);
    double want[3];
    color_chart_reference(false, 18, want);
    const float *p = picture.pixel + 3 * (picture.width * (picture.height - 5) + 5);
    for (size_t c = 0; c < 3; c++) assert_true(fabs((double)p[c] - want[c] * cos(1.0)) < 1e-5);
    image_release(&picture);
    assert_int_equal(color_chart_measure(&k, &im, 0.5, 0.0, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "white patch is saturated"));
    memcpy(k.corner_px, (double[8]){650, 120, 650, 450, 150, 450, 150, 120}, sizeof corner);
    assert_int_equal(color_chart_measure(&k, &im, INFINITY, 0.0, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "order of the corners"));
    memcpy(k.corner_px, (double[8]){150, 120, 950, 120, 950, 450, 150, 450}, sizeof corner);
    assert_int_equal(color_chart_measure(&k, &im, INFINITY, 0.0, &err), STATUS_INVALID);
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
    struct color_chart k = {.corner_px = {NAN}};
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
    if (color_chart_measure(&k, &im, INFINITY, 0.0, &err) != STATUS_OK) fail_msg("%s", err.text);
    double before = 0.0, after = 0.0;
    for (size_t i = 0; i < 24; i++) {
        before += k.delta_e_before[i] / 24.0;
        after += k.delta_e_after[i] / 24.0;
    }
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
        cmocka_unit_test(test_matrix),         cmocka_unit_test(test_errors_of_the_matrix),
        cmocka_unit_test(test_reference),      cmocka_unit_test(test_delta_e),
        cmocka_unit_test(test_drawn_charts),   cmocka_unit_test(test_same_chart_again),
        cmocka_unit_test(test_refused_charts), cmocka_unit_test(test_real_chart),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
