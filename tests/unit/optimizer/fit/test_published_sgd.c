/* The step rule of published_sgd.v1 (fabric thesis 5.5.4), on a problem whose gradient is the same everywhere: the
 * i-th step of a run is a / (50 + i), a grows threefold from run to run, and a run that oscillates is followed by ten
 * steps of a tenth of its last one. */
#include "base/catalogue/method_catalogue.h"
#include "optimizer/fit/descent/rescale.h"
#include "tests/support/descent_fixture.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { N_RUN = 6, N_ITERATION = 60, N_EXTRA = 10, N_FINAL = 4, MAX_STEP = N_RUN * N_ITERATION + N_EXTRA + N_FINAL };

static const struct param_info one_param[1] = {
    {"x", "x", PARAM_SHAPE, PARAM_UNIT_NONE, -1, 0.0, 1.0, 0.5, PARAM_LINEAR, ""}};

struct slope {
    bool alternates; /* the gradient changes its sign from one iteration to the next */
    size_t n_step;
    double param[MAX_STEP];
};

/* The first calls measure the picture as a function of x for the rescaling curve. It is linear, so that steps in the
 * rescaled parameter are proportional to steps in x. In the descent, picture and derivative do not depend on x. */
static status run_estimator(void *context, const struct estimator_call *call, const struct progress *progress,
                            struct estimate *out, double *wall_s, struct error *err)
{
    const struct slope *x = context;
    bool down = x->alternates && call->iteration % 2 == 0;
    (void)progress;
    (void)err;
    memset(out, 0, sizeof *out);
    *wall_s = 0.25;
    for (int c = 0; c < 3; c++) {
        out->mean[c] = call->replica == REPLICA_RESCALE ? call->param[0] : 0.6;
        out->var[c] = 1e-6;
        out->jac[c] = down ? -1.0 : 1.0;
    }
    out->n_path = call->n_path[0];
    return STATUS_OK;
}

static status on_step(void *context, const struct fit_step *step, struct error *err)
{
    struct slope *x = context;
    (void)err;
    assert_true(x->n_step < MAX_STEP);
    x->param[x->n_step++] = step->param[0];
    return STATUS_OK;
}

static void run(struct slope *x, double start)
{
    struct fit_parameter parameter = {one_param->lower, one_param->upper, start, false};
    struct observation row = {.set = JOB_SET_FIT, .weight = 1.0, .mean_rgb = {0.5, 0.5, 0.5}};
    struct observation_set observation;
    struct estimator estimator = {x, 1, 1, run_estimator};
    struct fit_result r;
    struct error err = {0};
    row.configuration = (struct configuration){
        .light_theta_rad = 0.5, .light_distance_m = 0.6, .lamp_side_m = 0.1, .camera_distance_m = 1.0, .crop_m = 0.01};
    observation_set_init(&observation);
    assert_int_equal(observation_set_append(&observation, &row, NULL), STATUS_OK);
    struct fit_problem problem = {.n_param = 1,
                                  .info = one_param,
                                  .parameter = &parameter,
                                  .observation = &observation,
                                  .estimator = &estimator,
                                  .report = on_step,
                                  .report_context = x};
    if (descent_find(method_published_sgd.id)->run(&problem, &r, &err) != STATUS_OK) fail_msg("%s", err.text);
    observation_set_release(&observation);
}

static double step_length(const struct slope *x, size_t i) { return fabs(x->param[i + 1] - x->param[i]); }

/* The first step of the first run moves x by 0.5 % of its range, all others follow from it. */
static void test_steps_decay(void **state)
{
    (void)state;
    struct slope x = {0};
    size_t n_checked = 0;
    double a = 0.005 * 50.0;
    run(&x, 0.9);
    assert_int_equal(x.n_step, N_RUN * N_ITERATION + N_FINAL);
    for (size_t k = 0; k < N_RUN; k++, a *= 3.0) {
        const size_t first = k * N_ITERATION;
        assert_true(x.param[first] == 0.9); /* every run begins at the start */
        for (size_t i = 0; i + 1 < N_ITERATION && x.param[first + i + 1] > one_param->lower; i++, n_checked++)
            if (fabs(step_length(&x, first + i) - a / (50.0 + (double)i)) > 1e-9)
                fail_msg("run %zu, step %zu: %.6f, published %.6f", k, i, step_length(&x, first + i),
                         a / (50.0 + (double)i));
    }
    assert_true(n_checked >= 2 * (N_ITERATION - 1)); /* the longer runs reach the bound before their end */
}

/* All runs end at the same objective, so the first one is the best. Its steps have alternating signs. */
static void test_steps_after_an_oscillation(void **state)
{
    (void)state;
    struct slope x = {.alternates = true};
    const size_t settling = N_RUN * N_ITERATION;
    run(&x, 0.5);
    assert_int_equal(x.n_step, MAX_STEP);
    for (size_t i = 0; i + 1 < N_ITERATION; i++)
        assert_true(fabs(step_length(&x, i) - 0.25 / (50.0 + (double)i)) < 1e-9);
    for (size_t i = 0; i < N_EXTRA; i++)
        assert_true(fabs(step_length(&x, settling + i) - 0.1 * 0.25 / (50.0 + N_ITERATION - 1.0)) < 1e-9);
}

/* Short runs have too few steps to compare. Such a fit is not converged, however low the objective is. */
static void test_published_sgd_needs_steps(void **state)
{
    (void)state;
    for (size_t n_iteration = 1; n_iteration <= 10; n_iteration += 3) {
        struct descent_fixture x;
        struct fit_result r;
        descent_fixture_init(&x, 1, 400000);
        x.problem.max_iteration = n_iteration;
        descent_fixture_run(&x, descent_find(method_published_sgd.id), &r);
        if (r.converged || r.stop != STOP_TOO_FEW_STEPS || strstr(r.reason, "too few to tell") == NULL)
            fail_msg("%zu iterations: %s", n_iteration, r.reason);
        observation_set_release(&x.observation);
    }
}

/* Steps in the same direction have a mean cosine near 1, also in the shortest run that is long enough. */
static void test_published_sgd_mean_cosine_has_no_start(void **state)
{
    (void)state;
    struct descent_fixture x;
    struct fit_result r;
    double cosine = 0.0;
    descent_fixture_init(&x, 1, 40000000);
    x.cloth.noise = 1e-3;
    x.problem.max_iteration = 11;
    for (size_t p = 0; p < FAKE_N_PARAM; p++) x.parameter[p].fixed = p != 8; /* one parameter: cosines are 1 or -1 */
    descent_fixture_run(&x, descent_find(method_published_sgd.id), &r);
    const char *text = strstr(r.reason, "mean cosine of ");
    assert_non_null(text);
    cosine = strtod(text + strlen("mean cosine of "), NULL);
    print_message("%s\n", r.reason);
    assert_true(fabs(cosine) > 0.99);
    observation_set_release(&x.observation);
}

/* A fit of the analytic cloth whose first n_free colours of transmission are free, or all parameters (0). */
static struct fit_result fit_free(uint64_t seed, size_t n_free, double budget, double *rel_rms)
{
    struct descent_fixture x;
    struct fit_result r;
    descent_fixture_init(&x, seed, (uint64_t)budget);
    for (size_t p = 0; p < FAKE_N_PARAM && n_free > 0; p++) {
        x.parameter[p].fixed = p < 3 || p >= 3 + n_free;
        if (x.parameter[p].fixed) x.parameter[p].start = x.truth[p];
    }
    descent_fixture_run(&x, descent_find(method_published_sgd.id), &r);
    *rel_rms = fake_rel_rms(&x.cloth, 0, FAKE_N_FIT, r.param, x.truth);
    observation_set_release(&x.observation);
    return r;
}

/* Steps that follow noise point in all directions, like steps around a minimum. With few paths a run ends far from the
 * truth so, and must not count as converged. */
static void test_noise_is_no_minimum(void **state)
{
    (void)state;
    size_t n_still = 0;
    for (uint64_t seed = 1; seed <= 6; seed++) {
        for (size_t n_free = 0; n_free <= 3; n_free += 3) {
            double rel_rms;
            struct fit_result r = fit_free(seed, n_free, n_free > 0 ? 1.3e6 : 2e7, &rel_rms);
            print_message("%zu free: error %.3f, %s, %s\n", n_free, rel_rms, stop_reason_info(r.stop)->id, r.reason);
            n_still += r.stop == STOP_NOISE || r.stop == STOP_DECREASE_LEFT;
            if (r.converged) fail_msg("seed %d has converged at an error of %.3f", (int)seed, rel_rms);
        }
    }
    assert_true(n_still >= 3); /* by their steps alone these were at rest */
}

static void test_a_minimum_is_one(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= 3; seed++) {
        double rel_rms;
        struct fit_result r = fit_free(seed, 3, 1e9, &rel_rms);
        if (!r.converged || r.stop != STOP_SCHEDULE || rel_rms > 0.005) fail_msg("error %.4f, %s", rel_rms, r.reason);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_steps_decay),
        cmocka_unit_test(test_steps_after_an_oscillation),
        cmocka_unit_test(test_published_sgd_needs_steps),
        cmocka_unit_test(test_published_sgd_mean_cosine_has_no_start),
        cmocka_unit_test(test_noise_is_no_minimum),
        cmocka_unit_test(test_a_minimum_is_one),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
