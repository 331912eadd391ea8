/* Fits with the contrasts of a texture: they determine a parameter that means do not, do not disturb gains, and resume
 * with the same bits. */
#include "base/catalogue/method_catalogue.h"
#include "optimizer/fit/descent/estimate_journal.h"
#include "optimizer/fit/descent/fit_run.h"
#include "optimizer/fit/linear/linear_gain.h"
#include "optimizer/fit/objective/objective.h"
#include "tests/support/scratch_folder.h"
#include "tests/support/tracer/chess_board.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

struct fixture {
    struct board board;
    struct estimator estimator;
    struct observation_set observation;
    struct fit_parameter parameter[BOARD_N_PARAM];
    struct fit_problem problem;
    struct fit_option option;
};

static status count_rows(void *context, const struct fit_step *step, struct error *err)
{
    (void)context;
    (void)err;
    assert_int_equal(step->n_configuration, BOARD_N_VIEW); /* the series has no rows for contrasts */
    return STATUS_OK;
}

/* gain: exposure gain of the photographs. weight: that of the contrasts, 0 or 1. */
static void setup(struct fixture *x, double gain, double weight)
{
    memset(x, 0, sizeof *x);
    board_init(&x->board, 2);
    x->estimator = (struct estimator){&x->board, 2 * BOARD_N_VIEW, BOARD_N_PARAM, board_estimate};
    fit_option_init(&x->option);
    observation_set_init(&x->observation);
    for (size_t i = 0; i < BOARD_N_VIEW; i++) {
        struct observation o = {.weight = 1.0, .n_cell = BOARD_SIDE};
        for (size_t c = 0; c < 3; c++) {
            o.mean_rgb[c] = gain * board_truth[c];
            o.se_rgb[c] = 0.002 * board_truth[c];
            o.contrast_rgb[c] = board_contrast(board_truth[3]);
            o.contrast_se_rgb[c] = 0.02 * o.contrast_rgb[c];
        }
        assert_int_equal(observation_set_append(&x->observation, &o, NULL), STATUS_OK);
    }
    struct observation_set means = x->observation;
    assert_int_equal(observation_set_append_contrasts(&means, weight, &x->observation, NULL), STATUS_OK);
    assert_int_equal(x->observation.n, 2 * BOARD_N_VIEW);
    for (size_t p = 0; p < BOARD_N_PARAM; p++)
        x->parameter[p] =
            (struct fit_parameter){board_param[p].lower, board_param[p].upper, board_param[p].start, false};
    x->problem = (struct fit_problem){.n_param = BOARD_N_PARAM,
                                      .info = board_param,
                                      .parameter = x->parameter,
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

/* The means do not depend on t, but the contrast does. */
static void test_recovery(void **state)
{
    (void)state;
    struct fixture x;
    struct fit_result r;
    setup(&x, 1.0, 1e-12);
    fit(&x, &r);
    assert_true(!r.uncertainty.determined[3]);
    for (size_t p = 0; p < 3; p++)
        assert_true(r.uncertainty.determined[p] && fabs(r.param[p] / board_truth[p] - 1.0) < 0.02);
    release(&x);
    setup(&x, 1.0, 1.0);
    fit(&x, &r);
    for (size_t p = 0; p < BOARD_N_PARAM; p++) {
        assert_true(r.uncertainty.determined[p]);
        assert_true(fabs(r.param[p] - board_truth[p]) < 3.5 * r.uncertainty.se_param[p]);
        assert_true(r.uncertainty.se_param[p] < 0.05 * board_truth[p]);
    }
    release(&x);
}

/* A gain of the photographs does not change their contrasts. */
static void test_gain(void **state)
{
    (void)state;
    struct fixture x;
    struct fit_result r;
    for (int kind = 0; kind < 2; kind++) {
        setup(&x, 1.1, 1.0);
        for (size_t p = 0; p < 3; p++) x.parameter[p] = (struct fit_parameter){0.01, 1.0, board_truth[p], true};
        *(kind == 0 ? &x.option.global_gain_sd : &x.option.photograph_gain_sd) = 0.1;
        fit(&x, &r);
        assert_true(fabs(r.param[3] - board_truth[3]) < 3.5 * r.uncertainty.se_param[3]);
        assert_true(r.uncertainty.se_param[3] < 0.05 * board_truth[3]);
        if (kind == 0) assert_true(fabs(r.nuisance.value[0] - 1.1) < 3.5 * r.nuisance.se[0]);
        release(&x);
    }
}

/* Each photograph is 5 % too bright or too dark, and the model does not fit the contrasts. The gains are found as if
 * there were no contrasts. */
static void test_gains_beside_contrasts_that_do_not_fit(void **state)
{
    (void)state;
    enum { N = 16 };
    struct observation_set o;
    struct linear_model m;
    observation_set_init(&o);
    for (size_t i = 0; i < 2 * N; i++) {
        struct observation item = {.weight = 1.0, .mean_rgb = {0.3, 0.2, 0.4}};
        if (i >= N) item.configuration.contrast_cells = BOARD_SIDE;
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
        cmocka_unit_test(test_recovery),
        cmocka_unit_test(test_gain),
        cmocka_unit_test(test_gains_beside_contrasts_that_do_not_fit),
        cmocka_unit_test(test_resume),
    };
    return cmocka_run_group_tests(tests, scratch_folder_setup, scratch_folder_teardown);
}
