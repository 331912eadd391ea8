/* Contrasts of photographs: of a chess board with noise, their stated errors, and blocks whose edges divide pixels. */
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/photographs/reader/photograph.h"
#include "optimizer/photographs/reader/photograph_contrast.h"
#include "optimizer/photographs/rows/observation.h"
#include "optimizer/photographs/rows/observation_load.h"
#include "tests/support/scratch_folder.h"
#include "tests/support/tracer/chess_board.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* The same picture with five times as many pixels along each edge. */
static double magnified_contrast(const struct image *im)
{
    enum { TIMES = 5 };
    struct image large;
    double contrast, se;
    assert_int_equal(image_init(&large, TIMES * im->width, TIMES * im->height, 3, NULL), STATUS_OK);
    for (size_t i = 0; i < large.width * large.height; i++)
        for (size_t c = 0; c < 3; c++)
            large.pixel[3 * i + c] = im->pixel[3 * (i / large.width / TIMES * im->width + i % large.width / TIMES) + c];
    assert_int_equal(image_contrast(&large, 0, 5, &contrast, &se, NULL), STATUS_OK);
    image_release(&large);
    return contrast;
}

/* Draws one of a series of square pictures in its first n_channel channels: a chess board of the contrast `chess`
 * with fields of BOARD_SIDE pixels, and a deviate of standard deviation sd for each block of `block` pixels a side. */
static void draw(struct image *im, const struct rng_key *key, size_t block, double chess, double sd, size_t n_channel)
{
    const size_t px = im->width;
    for (size_t i = 0; i < px * px; i++) {
        struct rng r;
        double z[2], sign = (i % px / BOARD_SIDE + i / px / BOARD_SIDE) % 2 == 0 ? 1.0 : -1.0;
        rng_start(&r, key, (uint32_t)(i / px / block * (px / block) + i % px / block), 0);
        rng_normal_pair(&r, z);
        for (size_t c = 0; c < n_channel; c++) im->pixel[3 * i + c] = (float)(1.0 + chess * sign + sd * z[0]);
    }
}

/* A chess board with independent noise in every pixel, which changes the contrast as the header states; and blocks
 * whose edges divide pixels. */
static void test_photograph(void **state)
{
    enum { PX = 64, ROUND = 50 };
    double sum = 0.0, sum2 = 0.0, contrast, se, noise = 0.5;
    struct image im;
    assert_int_equal(image_init(&im, PX, PX, 3, NULL), STATUS_OK);
    for (uint32_t k = 0; k < ROUND; k++) {
        draw(&im, &(struct rng_key){.seed = 8, .iteration = k}, 1, 0.3, noise, 3);
        assert_int_equal(image_contrast(&im, 1, BOARD_SIDE, &contrast, &se, NULL), STATUS_OK);
        assert_true(se > 0.0 && se < contrast);
        sum += contrast / ROUND;
        sum2 += contrast * contrast / ROUND;
    }
    double of_noise = noise * noise / (PX / BOARD_SIDE * PX / BOARD_SIDE),
           error = sqrt((sum2 - sum * sum) / (ROUND - 1));
    assert_true(fabs(sum - board_contrast(0.3) - of_noise) < 4.0 * error + 0.01 * of_noise);
    assert_true(4.0 * error < of_noise);
    double cut;
    assert_int_equal(image_contrast(&im, 0, 5, &cut, &se, NULL), STATUS_OK); /* parts of 12.8 pixels */
    assert_true(fabs(cut / magnified_contrast(&im) - 1.0) < 1e-6);
    const char *path = scratch_path(state, "board.exr");
    const struct job_photograph whole = {.scale = 3.0};
    double rgb[3], rgb_se[3];
    struct error err = {0};
    assert_int_equal(image_write_exr(&im, path, NULL), STATUS_OK);
    image_release(&im);
    assert_int_equal(photograph_read(path, &whole, &im, NULL, NULL), STATUS_OK);
    assert_int_equal(photograph_contrast(&im, "board.exr", BOARD_SIDE, rgb, rgb_se, NULL), STATUS_OK);
    assert_true(fabs(rgb[2] / contrast - 1.0) < 1e-5);
    assert_int_equal(photograph_contrast(&im, "board.exr", CONFIGURATION_MAX_CELLS + 1, rgb, rgb_se, &err),
                     STATUS_INVALID);
    image_release(&im);
    assert_non_null(strstr(err.text, "board.exr"));
}

/* Blocks with random values: the stated error of a contrast is the standard deviation over such photographs. A black
 * channel has no contrast, and the row of the photograph is left out. */
static void test_photograph_error(void **state)
{
    (void)state;
    enum { PX = 2 * BOARD_SIDE, ROUND = 1000 };
    double sum = 0.0, sum2 = 0.0, contrast, se, stated = 0.0;
    struct image im;
    assert_int_equal(image_init(&im, PX, PX, 3, NULL), STATUS_OK);
    for (uint32_t k = 0; k < ROUND; k++) {
        draw(&im, &(struct rng_key){.seed = 9, .iteration = k}, 2, 0.0, 0.2, 2);
        assert_int_equal(image_contrast(&im, 0, BOARD_SIDE, &contrast, &se, NULL), STATUS_OK);
        sum += contrast / ROUND;
        sum2 += contrast * contrast / ROUND;
        stated += se * se / ROUND;
    }
    double ratio = sqrt(stated / (sum2 - sum * sum));
    print_message("stated error of a contrast over its scatter: %.3f\n", ratio);
    assert_true(fabs(ratio - 1.0) < 0.15); /* 1000 rounds: 3 % */
    assert_int_equal(image_contrast(&im, 2, BOARD_SIDE, &contrast, &se, NULL), STATUS_OK);
    assert_true(contrast == 0.0 && se == 1.0);
    image_release(&im);
    struct observation o = {
        .weight = 2.0, .n_cell = BOARD_SIDE, .contrast_rgb = {0.04, 0.04, 0.0}, .contrast_se_rgb = {0.01, 0.01, 1.0}};
    assert_true(observation_of_contrast(&o, 3.0).weight == 0.0);
    o.contrast_se_rgb[2] = 0.01;
    assert_true(observation_of_contrast(&o, 3.0).weight == 6.0);
}

static void count_warning(void *context, const char *option, const char *text)
{
    size_t *n = context;
    (void)option;
    assert_non_null(strstr(text, "'black-red.exr' is black in one of its channels"));
    ++*n;
}

/* A channel that is black has no texture to compare; that is worth a warning when the fit uses textures. */
static void test_warning_of_a_black_channel(void **state)
{
    struct job_photograph photograph = {.file = "black-red.exr", .scale = 1.0, .weight = 1.0};
    const char *path = scratch_path(state, photograph.file);
    char folder[1024];
    snprintf(folder, sizeof folder, "%.*s", (int)(strrchr(path, '/') - path), path);
    for (int black = 0; black < 2; black++)
        for (int used = 0; used < 2; used++) {
            const struct job_setup setup = {.crop_cm = 1.0};
            const struct job_rows rows = {.photograph = &photograph, .n_photograph = 1};
            const struct job_fit fit = {.texture_block_mm = 1.0, .texture_weight = used};
            struct observation_set o;
            struct image im;
            struct error err = {0};
            size_t n_warning = 0;
            assert_int_equal(image_init(&im, 40, 40, 3, NULL), STATUS_OK);
            draw(&im, &(struct rng_key){.seed = 3}, 1, 0.0, 0.05, 3);
            for (size_t i = 0; black && i < 40 * 40; i++) im.pixel[3 * i] = 0.0f;
            assert_int_equal(image_write_exr(&im, path, NULL), STATUS_OK);
            image_release(&im);
            observation_set_init(&o);
            if (observation_set_load(&setup, &rows, &fit, folder, NULL,
                                     &(struct warning_sink){count_warning, &n_warning}, &o, &err) != STATUS_OK)
                fail_msg("%s", err.text);
            assert_int_equal(n_warning, black && used);
            observation_set_release(&o);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_photograph),
        cmocka_unit_test(test_photograph_error),
        cmocka_unit_test(test_warning_of_a_black_channel),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
