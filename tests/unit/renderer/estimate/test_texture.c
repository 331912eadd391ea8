/* The contrast of a texture: estimates are unbiased for any number of paths, their errors and derivatives are right,
 * and they agree with the contrast of a rendered picture. */
#include "base/rng.h"
#include "renderer/estimate/render.h"
#include "renderer/transport/camera.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/tracer/chess_board.h"
#include "tests/support/tracer/orbit_configurations.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* With four paths in each cell, the plain variance of the cells' means would be 0.25 (1 + t^2) too large. The mean of
 * many estimates is right within its standard error, and the stated variances agree with the variance over many
 * estimates. */
static void test_unbiased(void **state)
{
    (void)state;
    enum { ROUND = 1000 };
    struct board b;
    struct estimate e[2 * BOARD_N_VIEW];
    double sum = 0.0, sum2 = 0.0, var = 0.0, j = 0.0, j2 = 0.0, j_var = 0.0, n = 0.0;
    board_init(&b, 1);
    for (uint32_t k = 0; k < ROUND; k++) {
        board_ask(&b, board_truth, 4 * BOARD_CELL, k, e);
        for (size_t i = BOARD_N_VIEW; i < 2 * BOARD_N_VIEW; i++, n += 1.0) {
            assert_int_equal(e[i].n_path, 4 * BOARD_CELL);
            assert_int_equal(e[i].n_path, estimate_n_path(&b.configuration[i], 4 * BOARD_CELL));
            sum += e[i].mean[1];
            sum2 += e[i].mean[1] * e[i].mean[1];
            var += e[i].var[1];
            j += e[i].jac[BOARD_N_PARAM + 3];
            j2 += e[i].jac[BOARD_N_PARAM + 3] * e[i].jac[BOARD_N_PARAM + 3];
            j_var += e[i].jac_var[BOARD_N_PARAM + 3];
        }
    }
    double mean = sum / n, scatter = sum2 / n - mean * mean, slope = j / n, slope_scatter = j2 / n - slope * slope;
    double want = board_contrast(board_truth[3]), want_slope = 2.0 * want / board_truth[3];
    double bias = 4.0 / (4.0 * BOARD_CELL); /* of the quotient, at most, relative: contrast_blocks.h */
    assert_true(fabs(mean - want) < 4.0 * sqrt(scatter / n) + bias * want);
    assert_true(4.0 * sqrt(scatter / n) + bias * want < 0.1 * 0.25);
    assert_true(fabs(slope - want_slope) < 4.0 * sqrt(slope_scatter / n) + bias * want_slope);
    /* a variance from n normal deviates is known to sqrt(2 / n) = 2.6 %; theirs have longer tails */
    assert_true(fabs(var / n / scatter - 1.0) < 0.15);
    assert_true(fabs(j_var / n / slope_scatter - 1.0) < 0.15);
    thread_pool_free(b.pool);
}

/* With the same random numbers the estimate is a smooth function of the parameters. */
static void test_derivative(void **state)
{
    (void)state;
    struct board b;
    struct estimate e[2 * BOARD_N_VIEW], side[2][2 * BOARD_N_VIEW];
    board_init(&b, 1);
    board_ask(&b, board_truth, 3000, 1, e);
    for (size_t p = 0; p < BOARD_N_PARAM; p++) {
        double h = 0.01 * board_truth[p];
        for (int s = 0; s < 2; s++) {
            double moved[BOARD_N_PARAM];
            memcpy(moved, board_truth, sizeof moved);
            moved[p] += s == 0 ? h : -h;
            board_ask(&b, moved, 3000, 1, side[s]);
        }
        for (size_t c = 0; c < 3; c++) {
            double difference = (side[0][BOARD_N_VIEW].mean[c] - side[1][BOARD_N_VIEW].mean[c]) / (2.0 * h);
            /* rounding of values to single precision; third derivatives */
            assert_true(fabs(e[BOARD_N_VIEW].jac[c * BOARD_N_PARAM + p] - difference) <
                        2e-4 * (0.1 + fabs(difference)));
        }
    }
    thread_pool_free(b.pool);
}

/* The result has the same bits for any number of threads. */
static void test_same_bits(void **state)
{
    (void)state;
    struct estimate want[2 * BOARD_N_VIEW], got[2 * BOARD_N_VIEW];
    for (size_t n_path = 1; n_path < 50000; n_path = 3 * n_path + 100) {
        for (size_t n_thread = 1; n_thread <= 3; n_thread++) {
            struct board b;
            board_init(&b, n_thread);
            board_ask(&b, board_truth, n_path, 9, n_thread == 1 ? want : got);
            if (n_thread > 1) assert_memory_equal(got, want, sizeof got);
            thread_pool_free(b.pool);
        }
        assert_true(want[BOARD_N_VIEW].n_path >= n_path && want[BOARD_N_VIEW].n_path < n_path + 4 * BOARD_CELL);
    }
}

/* A woven cloth seen by one camera. */
struct woven {
    struct fiber_set fiber;
    struct scene *scene;
    struct thread_pool *pool;
    struct configuration configuration[16];
    const struct scattering_model *model;
    struct appearance appearance;
    double param[SCATTERING_MAX_PARAM];
};

static void woven_init(struct woven *w)
{
    *w = (struct woven){.model = scattering_find("isotropic.v1")};
    for (size_t p = 0; p < w->model->n_param; p++) w->param[p] = w->model->param[p].start;
    hand_weave_small(&w->fiber);
    orbit_configurations_16(w->configuration);
    w->configuration[0].crop_m = 0.0011;
    assert_int_equal(scene_new(&w->fiber, &(struct scene_option){true}, &w->scene, NULL), STATUS_OK);
    assert_int_equal(thread_pool_new(2, &w->pool, NULL), STATUS_OK);
}

static void woven_release(struct woven *w)
{
    thread_pool_free(w->pool);
    scene_free(w->scene);
    fiber_set_release(&w->fiber);
}

static struct estimate_request woven_request(struct woven *w, const size_t *n_path)
{
    struct estimate_request q = {.input = trace_input_surface(w->scene, w->model, w->param, &w->appearance),
                                 .configuration = w->configuration,
                                 .n_configuration = 1,
                                 .n_path = n_path,
                                 .seed = 4};
    q.input.want_derivative = true;
    return q;
}

static void woven_picture(struct woven *w, struct image *im)
{
    const struct render_request q = {.input = trace_input_surface(w->scene, w->model, w->param, &w->appearance),
                                     .configuration = w->configuration,
                                     .width = BOARD_SIDE,
                                     .height = BOARD_SIDE,
                                     .n_sample = 1000,
                                     .seed = 3};
    assert_int_equal(render_run(&q, w->pool, NULL, im, NULL), STATUS_OK);
}

/* Contrast of one channel of a rendered picture without the noise of its pixels, and its standard error. */
static double picture_contrast(const struct image *im, size_t c, double *se)
{
    double mean = 0.0, sum = 0.0, noise = 0.0, var = 0.0;
    for (size_t i = 0; i < BOARD_CELL; i++) mean += (double)im->pixel[i * im->n_channel + c] / BOARD_CELL;
    for (size_t i = 0; i < BOARD_CELL; i++) {
        double d = (double)im->pixel[i * im->n_channel + c] / mean - 1.0;
        double own = (double)im->pixel[i * im->n_channel + 3 + c] / (mean * mean);
        sum += d * d;
        noise += own;
        var += 4.0 * d * d * own + 2.0 * own * own;
    }
    *se = sqrt(var) / (BOARD_CELL - 1.0);
    return (sum - noise * (BOARD_CELL - 1.0) / BOARD_CELL) / (BOARD_CELL - 1.0);
}

/* The estimated contrast of the cloth agrees with that of a rendered picture with as many pixels as cells. */
static void test_against_picture(void **state)
{
    (void)state;
    struct woven w;
    struct estimate e;
    struct image im = {0};
    const size_t n_path = 60000;
    woven_init(&w);
    woven_picture(&w, &im);
    w.configuration[0].contrast_cells = BOARD_SIDE;
    const struct estimate_request q = woven_request(&w, &n_path);
    assert_int_equal(estimate_run(&q, w.pool, NULL, &e, NULL), STATUS_OK);
    for (size_t c = 0; c < 3; c++) {
        double se, contrast = picture_contrast(&im, c, &se);
        assert_true(contrast > 0.01); /* there is a texture */
        assert_true(fabs(e.mean[c] - contrast) < 4.0 * hypot(se, sqrt(e.var[c])));
        assert_true(4.0 * hypot(se, sqrt(e.var[c])) < 0.5 * contrast);
    }
    image_release(&im);
    woven_release(&w);
}

/* A path of a blurred camera starts beside its pixel, as a Gaussian says; a sharp camera takes no random number. */
static void test_blurred_places(void **state)
{
    (void)state;
    enum { N = 40000 };
    struct configuration c[16];
    struct camera camera;
    struct rng rng;
    const double xy[2] = {0.3, 0.8};
    double at[2], sum[2] = {0}, sum2[2] = {0};
    orbit_configurations_16(c);
    camera_init(&camera, &c[0]);
    rng_start(&rng, &(struct rng_key){.seed = 2}, 0, 0);
    struct rng before = rng;
    camera_blur(&camera, xy, &rng, at);
    assert_true(at[0] == xy[0] && at[1] == xy[1]);
    assert_memory_equal(&rng, &before, sizeof rng);
    c[0].blur_m = 0.02 * c[0].crop_m;
    c[0].crop_aspect = 2.0; /* the crop is half as high as wide */
    camera_init(&camera, &c[0]);
    for (size_t i = 0; i < N; i++) {
        camera_blur(&camera, xy, &rng, at);
        for (int a = 0; a < 2; a++) {
            sum[a] += (at[a] - xy[a]) / N;
            sum2[a] += (at[a] - xy[a]) * (at[a] - xy[a]) / N;
        }
    }
    for (int a = 0; a < 2; a++) {
        double want = a == 0 ? 0.02 : 0.04;
        assert_true(fabs(sum[a]) < 4.0 * want / sqrt(N));
        assert_true(fabs(sqrt(sum2[a]) / want - 1.0) < 0.02);
    }
}

/* The contrast of a blurred camera agrees with that of its picture, and is less than that of a sharp one. */
static void test_blurred_contrast(void **state)
{
    (void)state;
    struct woven w;
    struct estimate sharp, blurred;
    struct image im = {0};
    const size_t n_path = 60000;
    woven_init(&w);
    w.configuration[0].contrast_cells = BOARD_SIDE;
    struct estimate_request q = woven_request(&w, &n_path);
    assert_int_equal(estimate_run(&q, w.pool, NULL, &sharp, NULL), STATUS_OK);
    w.configuration[0].blur_m = 0.5 * w.configuration[0].crop_m / BOARD_SIDE;
    assert_int_equal(estimate_run(&q, w.pool, NULL, &blurred, NULL), STATUS_OK);
    w.configuration[0].contrast_cells = 0;
    woven_picture(&w, &im);
    for (size_t c = 0; c < 3; c++) {
        double se, contrast = picture_contrast(&im, c, &se);
        assert_true(fabs(blurred.mean[c] - contrast) < 4.0 * hypot(se, sqrt(blurred.var[c])));
        assert_true(blurred.mean[c] + 4.0 * sqrt(blurred.var[c]) < sharp.mean[c]);
    }
    image_release(&im);
    woven_release(&w);
}

static void test_refused_requests(void **state)
{
    (void)state;
    struct woven w;
    struct estimate e;
    const size_t n_path = 256;
    woven_init(&w);
    w.configuration[0].contrast_cells = BOARD_SIDE;
    struct estimate_request q = woven_request(&w, &n_path);
    q.share_camera_paths = true;
    assert_int_equal(estimate_run(&q, w.pool, NULL, &e, NULL), STATUS_INVALID);
    q.share_camera_paths = false;
    w.configuration[0].contrast_cells = 1;
    assert_int_equal(estimate_run(&q, w.pool, NULL, &e, NULL), STATUS_INVALID);
    w.configuration[0].contrast_cells = CONFIGURATION_MAX_CELLS + 1;
    assert_int_equal(estimate_run(&q, w.pool, NULL, &e, NULL), STATUS_INVALID);
    woven_release(&w);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_unbiased),         cmocka_unit_test(test_derivative),
        cmocka_unit_test(test_same_bits),        cmocka_unit_test(test_against_picture),
        cmocka_unit_test(test_blurred_places),   cmocka_unit_test(test_blurred_contrast),
        cmocka_unit_test(test_refused_requests),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
