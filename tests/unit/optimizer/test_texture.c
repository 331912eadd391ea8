/* The contrast of a texture: estimates without bias at any number of paths, with their errors and derivatives; equal to
 * what a picture says; photographs measured alike; and a fit that only the contrast can determine, resumed bit by bit. */
#include "base/catalogue/method_catalogue.h"
#include "optimizer/fit/descent/estimate_journal.h"
#include "optimizer/fit/descent/fit_run.h"
#include "optimizer/fit/objective/linear_gain.h"
#include "optimizer/fit/objective/objective.h"
#include "optimizer/fit/photographs/photograph_contrast.h"
#include "renderer/transport/estimate_blocks.h"
#include "renderer/transport/render.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/scratch_folder.h"
#include "tests/support/tracer/orbit_configurations.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

/* A cloth like a chess board of 8 x 8 fields with radiance a_c (1 + t) and a_c (1 - t); a path sees that times an
 * exponential deviate (relative variance 1). Parameters: a_r, a_g, a_b, t. */
enum { N_PARAM = 4, SIDE = 8, CELL = SIDE * SIDE, N_VIEW = 3 };

static const struct param_info board_param[N_PARAM] = {
    {"a.r", "a", PARAM_COLOUR, PARAM_UNIT_NONE, 0, 0.01, 1.0, 0.5, PARAM_LOG, ""},
    {"a.g", "a", PARAM_COLOUR, PARAM_UNIT_NONE, 1, 0.01, 1.0, 0.5, PARAM_LOG, ""},
    {"a.b", "a", PARAM_COLOUR, PARAM_UNIT_NONE, 2, 0.01, 1.0, 0.5, PARAM_LOG, ""},
    {"t", "t", PARAM_SHAPE, PARAM_UNIT_NONE, -1, 0.01, 0.9, 0.1, PARAM_LOGIT, ""},
};
static const double truth[N_PARAM] = {0.3, 0.2, 0.4, 0.3};

static double true_contrast(double t) { return t * t * CELL / (CELL - 1.0); }

struct board {
    const double *param;
    bool want_jacobian;
    struct thread_pool *pool;
    struct configuration configuration[2 * N_VIEW];
    size_t n_call, fail_after;
};

static void trace_one(const struct board *b, const double xy[2], struct rng *rng, float *value)
{
    double sign = ((size_t)(xy[0] * SIDE) + (size_t)(xy[1] * SIDE)) % 2 == 0 ? 1.0 : -1.0;
    double bright = -log(1.0 - rng_double(rng));
    for (size_t c = 0; c < 3; c++) {
        value[c] = (float)(b->param[c] * (1.0 + sign * b->param[3]) * bright);
        if (!b->want_jacobian) continue;
        value[3 + c * N_PARAM + c] = (float)((1.0 + sign * b->param[3]) * bright);
        value[3 + c * N_PARAM + 3] = (float)(b->param[c] * sign * bright);
    }
}

static uint64_t trace(const void *state, const struct radiance_block *block, float *value)
{
    const struct board *b = state;
    size_t n_value = 3 + (b->want_jacobian ? 3 * N_PARAM : 0);
    for (size_t i = 0; i < block->n_path; i++) trace_one(b, block->xy[i], &block->rng[i], value + i * n_value);
    return block->n_path;
}

static const struct radiance_tracer board_tracer = {.max_member = 1, .trace = trace};

static status estimate(void *context, const struct estimator_call *call, const struct progress *progress,
                       struct estimate *out, double *wall_s, struct error *err)
{
    struct board *b = context;
    if (b->fail_after > 0 && b->n_call == b->fail_after) return error_set(err, STATUS_IO, "killed here");
    b->n_call++;
    b->param = call->param;
    b->want_jacobian = call->want_jacobian;
    struct path_groups groups;
    struct estimate_fault fault;
    const struct radiance_source source = {
        .tracer = &board_tracer, .state = b, .n_set = 1, .n_flat = call->want_jacobian ? N_PARAM : 0};
    const struct estimate_blocks q = {.source = &source,
                                      .configuration = b->configuration,
                                      .n_configuration = 2 * N_VIEW,
                                      .groups = &groups,
                                      .key = {.seed = 5, .iteration = call->iteration, .replica = call->replica},
                                      .progress = progress};
    *wall_s = 0.0;
    assert_int_equal(path_groups_single(&groups, call->n_path, 2 * N_VIEW, err), STATUS_OK);
    status s = estimate_blocks_run(&q, b->pool, out, &fault, err);
    path_groups_release(&groups);
    return s;
}

static void board_init(struct board *b, size_t n_thread)
{
    memset(b, 0, sizeof *b);
    for (size_t i = 0; i < N_VIEW; i++) b->configuration[N_VIEW + i].contrast_cells = SIDE;
    assert_int_equal(thread_pool_new(n_thread, &b->pool, NULL), STATUS_OK);
}

static void ask(struct board *b, const double *param, size_t n_path, uint32_t iteration, struct estimate *e)
{
    const size_t count[2 * N_VIEW] = {n_path, n_path, n_path, n_path, n_path, n_path};
    struct estimator_call call = {param, count, iteration, 0, true};
    double wall_s;
    assert_int_equal(estimate(b, &call, NULL, e, &wall_s, NULL), STATUS_OK);
}

/* Four paths a cell, where the plain variance of the cells' means would be 0.25 (1 + t^2) too large; the mean of many
 * estimates is right within its error, and the stated variances are those of the scatter. */
static void test_unbiased(void **state)
{
    (void)state;
    enum { ROUND = 1000 };
    struct board b;
    struct estimate e[2 * N_VIEW];
    double sum = 0.0, sum2 = 0.0, var = 0.0, j = 0.0, j2 = 0.0, j_var = 0.0, n = 0.0;
    board_init(&b, 1);
    for (uint32_t k = 0; k < ROUND; k++) {
        ask(&b, truth, 4 * CELL, k, e);
        for (size_t i = N_VIEW; i < 2 * N_VIEW; i++, n += 1.0) {
            assert_int_equal(e[i].n_path, 4 * CELL);
            assert_int_equal(e[i].n_path, estimate_n_path(&b.configuration[i], 4 * CELL));
            sum += e[i].mean[1];
            sum2 += e[i].mean[1] * e[i].mean[1];
            var += e[i].var[1];
            j += e[i].jac[N_PARAM + 3];
            j2 += e[i].jac[N_PARAM + 3] * e[i].jac[N_PARAM + 3];
            j_var += e[i].jac_var[N_PARAM + 3];
        }
    }
    double mean = sum / n, scatter = sum2 / n - mean * mean, slope = j / n, slope_scatter = j2 / n - slope * slope;
    double want = true_contrast(truth[3]), want_slope = 2.0 * want / truth[3];
    double bias = 4.0 / (4.0 * CELL); /* of the quotient, at most, relative: contrast_blocks.h */
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
    struct estimate e[2 * N_VIEW], side[2][2 * N_VIEW];
    board_init(&b, 1);
    ask(&b, truth, 3000, 1, e);
    for (size_t p = 0; p < N_PARAM; p++) {
        double h = 0.01 * truth[p];
        for (int s = 0; s < 2; s++) {
            double moved[N_PARAM];
            memcpy(moved, truth, sizeof moved);
            moved[p] += s == 0 ? h : -h;
            ask(&b, moved, 3000, 1, side[s]);
        }
        for (size_t c = 0; c < 3; c++) {
            double difference = (side[0][N_VIEW].mean[c] - side[1][N_VIEW].mean[c]) / (2.0 * h);
            /* rounding of values to single precision; third derivatives */
            assert_true(fabs(e[N_VIEW].jac[c * N_PARAM + p] - difference) < 2e-4 * (0.1 + fabs(difference)));
        }
    }
    thread_pool_free(b.pool);
}

/* Any number of threads. */
static void test_same_bits(void **state)
{
    (void)state;
    struct estimate want[2 * N_VIEW], got[2 * N_VIEW];
    for (size_t n_path = 1; n_path < 50000; n_path = 3 * n_path + 100) {
        for (size_t n_thread = 1; n_thread <= 3; n_thread++) {
            struct board b;
            board_init(&b, n_thread);
            ask(&b, truth, n_path, 9, n_thread == 1 ? want : got);
            if (n_thread > 1) assert_memory_equal(got, want, sizeof got);
            thread_pool_free(b.pool);
        }
        assert_true(want[N_VIEW].n_path >= n_path && want[N_VIEW].n_path < n_path + 4 * CELL);
    }
}

/* A real cloth: the contrast of its estimate is that of the pixels of a picture with as many pixels as cells. */
static void test_against_picture(void **state)
{
    (void)state;
    struct fiber_set f;
    struct scene *scene = NULL;
    struct thread_pool *pool = NULL;
    struct configuration configuration[16];
    const struct scattering_model *model = scattering_find("isotropic.v1");
    double param[SCATTERING_MAX_PARAM];
    const size_t n_path = 60000;
    struct estimate e;
    struct image im = {0};
    for (size_t p = 0; p < model->n_param; p++) param[p] = model->param[p].start;
    hand_weave_small(&f);
    orbit_configurations_16(configuration);
    configuration[0].crop_m = 0.0011;
    assert_int_equal(scene_new(&f, &(struct scene_option){true}, &scene, NULL), STATUS_OK);
    assert_int_equal(thread_pool_new(2, &pool, NULL), STATUS_OK);
    struct appearance appearance;
    struct render_request picture = {.input = trace_input_surface(scene, model, param, &appearance),
                                     .configuration = configuration,
                                     .width = SIDE,
                                     .height = SIDE,
                                     .n_sample = 1000,
                                     .seed = 3};
    assert_int_equal(render_run(&picture, pool, NULL, &im, NULL), STATUS_OK);
    configuration[0].contrast_cells = SIDE;
    struct estimate_request q = {.input = trace_input_surface(scene, model, param, &appearance),
                                 .configuration = configuration,
                                 .n_configuration = 1,
                                 .n_path = &n_path,
                                 .seed = 4};
    q.input.want_derivative = true;
    assert_int_equal(estimate_run(&q, pool, NULL, &e, NULL), STATUS_OK);
    for (size_t c = 0; c < 3; c++) {
        double mean = 0.0, sum = 0.0, noise = 0.0, var = 0.0;
        for (size_t i = 0; i < CELL; i++) mean += (double)im.pixel[i * im.n_channel + c] / CELL;
        for (size_t i = 0; i < CELL; i++) {
            double d = (double)im.pixel[i * im.n_channel + c] / mean - 1.0;
            double own = (double)im.pixel[i * im.n_channel + 3 + c] / (mean * mean);
            sum += d * d;
            noise += own;
            var += 4.0 * d * d * own + 2.0 * own * own;
        }
        double contrast = (sum - noise * (CELL - 1.0) / CELL) / (CELL - 1.0), se = sqrt(var) / (CELL - 1.0);
        assert_true(contrast > 0.01); /* there is a texture */
        assert_true(fabs(e.mean[c] - contrast) < 4.0 * hypot(se, sqrt(e.var[c])));
        assert_true(4.0 * hypot(se, sqrt(e.var[c])) < 0.5 * contrast);
    }
    const size_t few = 256;
    q.n_path = &few;
    q.share_camera_paths = true;
    assert_int_equal(estimate_run(&q, pool, NULL, &e, NULL), STATUS_INVALID);
    q.share_camera_paths = false;
    configuration[0].contrast_cells = 1;
    assert_int_equal(estimate_run(&q, pool, NULL, &e, NULL), STATUS_INVALID);
    configuration[0].contrast_cells = CONFIGURATION_MAX_CELLS + 1;
    assert_int_equal(estimate_run(&q, pool, NULL, &e, NULL), STATUS_INVALID);
    image_release(&im);
    thread_pool_free(pool);
    scene_free(scene);
    fiber_set_release(&f);
}

/* The same picture with five times as many pixels a side. */
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

/* A chess board with independent noise of every pixel, whose share is as the header says; parts whose edges cut through
 * pixels. */
static void test_photograph(void **state)
{
    enum { PX = 64, ROUND = 50 };
    double sum = 0.0, sum2 = 0.0, contrast, se, noise = 0.5;
    struct image im;
    assert_int_equal(image_init(&im, PX, PX, 3, NULL), STATUS_OK);
    for (uint32_t k = 0; k < ROUND; k++) {
        const struct rng_key key = {.seed = 8, .iteration = k};
        for (size_t i = 0; i < PX * PX; i++) {
            struct rng r;
            double z[2], sign = (i % PX / SIDE + i / PX / SIDE) % 2 == 0 ? 1.0 : -1.0;
            rng_start(&r, &key, (uint32_t)i, 0);
            rng_normal_pair(&r, z);
            for (size_t c = 0; c < 3; c++) im.pixel[3 * i + c] = (float)(1.0 + 0.3 * sign + noise * z[0]);
        }
        assert_int_equal(image_contrast(&im, 1, SIDE, &contrast, &se, NULL), STATUS_OK);
        assert_true(se > 0.0 && se < contrast);
        sum += contrast / ROUND;
        sum2 += contrast * contrast / ROUND;
    }
    double of_noise = noise * noise / (PX / SIDE * PX / SIDE), error = sqrt((sum2 - sum * sum) / (ROUND - 1));
    assert_true(fabs(sum - true_contrast(0.3) - of_noise) < 4.0 * error + 0.01 * of_noise);
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
    assert_int_equal(photograph_contrast(path, &whole, SIDE, rgb, rgb_se, NULL), STATUS_OK);
    assert_true(fabs(rgb[2] / contrast - 1.0) < 1e-5);
    assert_int_equal(photograph_contrast(path, &whole, CONFIGURATION_MAX_CELLS + 1, rgb, rgb_se, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "board.exr"));
}

/* Blocks that scatter at random: the stated error of a contrast is the scatter of contrasts of such photographs. A channel that is
 * black has no contrast, and the photograph's row does not count. */
static void test_photograph_error(void **state)
{
    (void)state;
    enum { PX = 2 * SIDE, ROUND = 1000 };
    double sum = 0.0, sum2 = 0.0, contrast, se, stated = 0.0;
    struct image im;
    assert_int_equal(image_init(&im, PX, PX, 3, NULL), STATUS_OK);
    for (uint32_t k = 0; k < ROUND; k++) {
        const struct rng_key key = {.seed = 9, .iteration = k};
        for (size_t i = 0; i < PX * PX; i++) {
            struct rng r;
            double z[2];
            rng_start(&r, &key, (uint32_t)(i / PX / 2 * SIDE + i % PX / 2), 0); /* of its block */
            rng_normal_pair(&r, z);
            im.pixel[3 * i] = im.pixel[3 * i + 1] = (float)(1.0 + 0.2 * z[0]);
        }
        assert_int_equal(image_contrast(&im, 0, SIDE, &contrast, &se, NULL), STATUS_OK);
        sum += contrast / ROUND;
        sum2 += contrast * contrast / ROUND;
        stated += se * se / ROUND;
    }
    double ratio = sqrt(stated / (sum2 - sum * sum));
    print_message("stated error of a contrast over its scatter: %.3f\n", ratio);
    assert_true(fabs(ratio - 1.0) < 0.15); /* 1000 rounds: 3 % */
    assert_int_equal(image_contrast(&im, 2, SIDE, &contrast, &se, NULL), STATUS_OK);
    assert_true(contrast == 0.0 && se == 1.0);
    image_release(&im);
    struct observation o = {
        .weight = 2.0, .n_cell = SIDE, .contrast_rgb = {0.04, 0.04, 0.0}, .contrast_se_rgb = {0.01, 0.01, 1.0}};
    assert_true(observation_of_contrast(&o, 3.0).weight == 0.0);
    o.contrast_se_rgb[2] = 0.01;
    assert_true(observation_of_contrast(&o, 3.0).weight == 6.0);
}

struct fixture {
    struct board board;
    struct estimator estimator;
    struct observation_set observation;
    struct fit_parameter parameter[N_PARAM];
    struct fit_problem problem;
    struct fit_option option;
};

static status count_rows(void *context, const struct fit_step *step, struct error *err)
{
    (void)context;
    (void)err;
    assert_int_equal(step->n_configuration, N_VIEW); /* contrasts are no rows of the series */
    return STATUS_OK;
}

/* gain: of the photographs. Contrasts have no weight, or one. */
static void setup(struct fixture *x, double gain, double weight)
{
    memset(x, 0, sizeof *x);
    board_init(&x->board, 2);
    x->estimator = (struct estimator){&x->board, 2 * N_VIEW, N_PARAM, estimate};
    fit_option_init(&x->option);
    observation_set_init(&x->observation);
    for (size_t i = 0; i < N_VIEW; i++) {
        struct observation o = {.weight = 1.0, .n_cell = SIDE};
        for (size_t c = 0; c < 3; c++) {
            o.mean_rgb[c] = gain * truth[c];
            o.se_rgb[c] = 0.002 * truth[c];
            o.contrast_rgb[c] = true_contrast(truth[3]);
            o.contrast_se_rgb[c] = 0.02 * o.contrast_rgb[c];
        }
        assert_int_equal(observation_set_append(&x->observation, &o, NULL), STATUS_OK);
    }
    struct observation_set means = x->observation;
    assert_int_equal(observation_set_append_contrasts(&means, weight, &x->observation, NULL), STATUS_OK);
    assert_int_equal(x->observation.n, 2 * N_VIEW);
    for (size_t p = 0; p < N_PARAM; p++)
        x->parameter[p] =
            (struct fit_parameter){board_param[p].lower, board_param[p].upper, board_param[p].start, false};
    x->problem = (struct fit_problem){.n_param = N_PARAM,
                                      .info = board_param,
                                      .param = x->parameter,
                                      .observation = &x->observation,
                                      .estimator = &x->estimator,
                                      .path_budget = 1500000,
                                      .report = count_rows};
}

static void release(struct fixture *x)
{
    observation_set_release(&x->observation);
    thread_pool_free(x->board.pool);
}

static void fit(struct fixture *x, struct fit_result *r)
{
    struct error err = {0};
    if (fit_run(descent_find(method_gauss_newton.id), &x->problem, &x->option, r, &err) != STATUS_OK)
        fail_msg("%s", err.text);
}

/* Means say nothing of t; the contrast does. */
static void test_recovery(void **state)
{
    (void)state;
    struct fixture x;
    struct fit_result r;
    setup(&x, 1.0, 1e-12);
    fit(&x, &r);
    assert_true(!r.uncertainty.determined[3]);
    for (size_t p = 0; p < 3; p++) assert_true(r.uncertainty.determined[p] && fabs(r.param[p] / truth[p] - 1.0) < 0.02);
    release(&x);
    setup(&x, 1.0, 1.0);
    fit(&x, &r);
    for (size_t p = 0; p < N_PARAM; p++) {
        assert_true(r.uncertainty.determined[p]);
        assert_true(fabs(r.param[p] - truth[p]) < 3.5 * r.uncertainty.se_param[p]);
        assert_true(r.uncertainty.se_param[p] < 0.05 * truth[p]);
    }
    release(&x);
}

/* A gain of the photographs does not touch their contrasts. */
static void test_gain(void **state)
{
    (void)state;
    struct fixture x;
    struct fit_result r;
    for (int kind = 0; kind < 2; kind++) {
        setup(&x, 1.1, 1.0);
        for (size_t p = 0; p < 3; p++) x.parameter[p] = (struct fit_parameter){0.01, 1.0, truth[p], true};
        *(kind == 0 ? &x.option.global_gain_sd : &x.option.photograph_gain_sd) = 0.1;
        fit(&x, &r);
        assert_true(fabs(r.param[3] - truth[3]) < 3.5 * r.uncertainty.se_param[3]);
        assert_true(r.uncertainty.se_param[3] < 0.05 * truth[3]);
        if (kind == 0) assert_true(fabs(r.nuisance.value[0] - 1.1) < 3.5 * r.nuisance.se[0]);
        release(&x);
    }
}

/* Photographs that are 5 % too bright or too dark each, and contrasts that the model misses by far: the gains are taken out as
 * if there were no contrasts. */
static void test_gains_beside_contrasts_that_do_not_fit(void **state)
{
    (void)state;
    enum { N = 16 };
    struct observation_set o;
    struct linear_model m;
    observation_set_init(&o);
    for (size_t i = 0; i < 2 * N; i++) {
        struct observation item = {.weight = 1.0, .mean_rgb = {0.3, 0.2, 0.4}};
        if (i >= N) item.configuration.contrast_cells = SIDE;
        assert_int_equal(observation_set_append(&o, &item, NULL), STATUS_OK);
    }
    assert_int_equal(linear_model_init(&m, 6 * N, 1, NULL), STATUS_OK);
    m.gain_sd = 0.05;
    for (size_t row = 0; row < m.n_row; row++) {
        const struct observation *item = &o.item[row / 3];
        double gain = row / 3 % 2 == 0 ? 0.05 : -0.05;
        for (int q = 0; q < 2; q++)
            m.r[q][row] = row < 3 * N ? sqrt(objective_weight(item)) * item->mean_rgb[row % 3] * gain : 0.15;
    }
    linear_gain_absorb(&m, &o);
    for (size_t row = 0; row < m.n_row; row++) {
        double before = row < 3 * N ? 0.05 * sqrt(objective_weight(&o.item[0])) * o.item[0].mean_rgb[row % 3] : 0.15;
        assert_true(row < 3 * N ? fabs(m.r[0][row]) < 0.1 * before : m.r[0][row] == before);
    }
    linear_model_release(&m);
    observation_set_release(&o);
}

static void test_resume(void **state)
{
    struct fixture x;
    struct fit_result want, got;
    const char *path = scratch_path(state, "texture.journal");
    setup(&x, 1.0, 1.0);
    x.problem.max_iteration = 4;
    fit(&x, &want);
    size_t n_call = x.board.n_call;
    assert_int_equal(n_call, 8);
    for (size_t cut = 1; cut < n_call; cut++) {
        unlink(path);
        for (int round = 0; round < 2; round++) {
            struct estimate_journal *j = NULL;
            x.board.n_call = 0;
            x.board.fail_after = round == 0 ? cut : 0;
            assert_int_equal(estimate_journal_open(path, 7, &x.estimator, NULL, NULL, &j, NULL), STATUS_OK);
            struct estimator through = estimate_journal_estimator(j);
            x.problem.estimator = &through;
            status s = fit_run(descent_find(method_gauss_newton.id), &x.problem, &x.option, &got, NULL);
            assert_int_equal(s, round == 0 ? STATUS_IO : STATUS_OK);
            if (round == 1) assert_int_equal(estimate_journal_n_replayed(j), cut);
            estimate_journal_close(j);
        }
        assert_memory_equal(got.param, want.param, sizeof got.param);
        assert_memory_equal(&got.uncertainty.se_param, &want.uncertainty.se_param, sizeof got.uncertainty.se_param);
        assert_true(got.objective.value == want.objective.value);
    }
    release(&x);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_unbiased),
        cmocka_unit_test(test_derivative),
        cmocka_unit_test(test_same_bits),
        cmocka_unit_test(test_against_picture),
        cmocka_unit_test(test_photograph),
        cmocka_unit_test(test_photograph_error),
        cmocka_unit_test(test_recovery),
        cmocka_unit_test(test_gain),
        cmocka_unit_test(test_gains_beside_contrasts_that_do_not_fit),
        cmocka_unit_test(test_resume),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
