/* The gradient certificate: every model passes it at its defaults and at its bounds, and wrong derivatives fail it. */
#include "renderer/estimate/derivative_check.h"
#include "renderer/transport/volume/volume_scene.h"
#include "tests/support/agreement.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/model/compared_range.h"
#include "tests/support/model/dear_tables.h"
#include "tests/support/scan/hand_volume.h"
#include "tests/support/tracer/orbit_configurations.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

struct fixture {
    struct scene *scene, *two_groups; /* of the same fibers: in one group; warp and weft apart */
    struct direction_volume v;
    struct volume_scene volume;
    struct configuration c[16]; /* N_CONFIGURATION */
};

static int setup(void **state)
{
    struct fixture *x = calloc(1, sizeof *x);
    struct fiber_set f;
    const size_t n[3] = {32, 32, 14};
    assert_non_null(x);
    hand_weave_small(&f);
    assert_int_equal(scene_new(&f, &(struct scene_option){.black_sheet = true}, &x->scene, NULL), STATUS_OK);
    memcpy(f.group, f.axis_class, f.n_fiber);
    assert_int_equal(scene_new(&f, &(struct scene_option){.black_sheet = true}, &x->two_groups, NULL), STATUS_OK);
    fiber_set_release(&f);
    hand_volume_weave(&x->v, n, 10e-6, 0.4);
    assert_int_equal(volume_scene_init(&x->volume, &x->v, &(struct volume_scene_option){.black_sheet = true}, NULL),
                     STATUS_OK);
    orbit_configurations_16(x->c);
    *state = x;
    return 0;
}

static int teardown(void **state)
{
    struct fixture *x = *state;
    scene_free(x->scene);
    scene_free(x->two_groups);
    volume_scene_release(&x->volume);
    direction_volume_release(&x->v);
    free(x);
    return 0;
}

enum { N_CONFIGURATION = 16, FEW_PATH = 2048, MOST_PATH = 32768 };

/* Rounding in single precision alone gives up to this error. */
static const double rounding = 2e-3;
/* Every comparison must see an error of 2 %; the noise may hide a tenth of it. */
static const double visible_error = 0.018;

/* Largest error that noise explains: 4.7 standard deviations are a chance of 1.3e-6, so 400 comparisons fail by chance
 * once in 2,000 runs with other random numbers. */
static double tolerance(const struct derivative_check *check, size_t p)
{
    return rounding + check->noise[p] + 4.7 * check->noise_se[p];
}

static struct derivative_check_request request(const struct fixture *x, const struct appearance *m, const double *param)
{
    const struct appearance_scene scene = {.fibers = x->scene, .volume = &x->volume};
    return (struct derivative_check_request){.input = {.scene = scene, .model = m, .param = param},
                                             .configuration = x->c,
                                             .n_configuration = N_CONFIGURATION,
                                             .n_path = FEW_PATH,
                                             .seed = 3,
                                             .replica = 5};
}

enum place { LOWER_BOUNDS, DEFAULTS, UPPER_BOUNDS, CLEAR_CLOTH, N_PLACE };

/* A step of the differences is 0.0002 of C_T. At 0.001, where scattering of fibers by wave optics goes as about the
 * cube root of C_T, that is a fifth of it, and the root bends within. test_scattering compares there, with smaller
 * steps. */
static double least_color(const struct appearance *m, const struct param_info *i)
{
    return strncmp(m->id, "wave", 4) == 0 ? 0.01 : compared_range_lower(m->id, i);
}

/* Clear cloth has the first colour at its lower bound beside bright ones, so that paths are long. Colours are not at
 * their bounds elsewhere: a white path never ends, and black has no light. */
static void place_parameters(const struct appearance *m, enum place place, double *param)
{
    for (size_t p = 0; p < m->n_param; p++) {
        const struct param_info *i = &m->param[p];
        param[p] = place == LOWER_BOUNDS ? compared_range_lower(m->id, i) : place == UPPER_BOUNDS ? i->upper : i->start;
        if (i->channel < 0 || place == DEFAULTS) continue;
        param[p] = place == LOWER_BOUNDS ? 0.2 : place == CLEAR_CLOTH && p < 3 ? least_color(m, i) : 0.9;
    }
    if (m->kind == MODEL_VOLUME) param[m->n_param - 1] = m->param[m->n_param - 1].start;
}

static void fail_of(const struct derivative_check *check, size_t p, const struct appearance *m)
{
    fail_msg("%s, set %zu, %s: %.2g, noise %.2g +- %.1g", m->id, p / m->n_param, m->param[p % m->n_param].name,
             check->error[p], check->noise[p], check->noise_se[p]);
}

/* Fails the test where a parameter that is visible misses its differences; looks at it no longer. Returns the largest
 * factor by which the noise of the others is too large. */
static double judge_visible(const struct appearance *m, const struct derivative_check *check, bool *skip)
{
    double most_noise = 0.0;
    for (size_t p = 0; p < check->n_param; p++) {
        if (skip[p]) continue;
        skip[p] = tolerance(check, p) < visible_error;
        if (skip[p] && check->error[p] > tolerance(check, p)) fail_of(check, p, m);
        if (!skip[p]) most_noise = fmax(most_noise, (tolerance(check, p) - rounding) / (visible_error - rounding));
    }
    return most_noise;
}

/* Traces more paths, as many as the noise of the last ones calls for, until a visible error of every parameter is
 * beyond the noise. Fails the test where MOST_PATH are too few for that. skip is true of all parameters then. */
static void check_until_visible(struct derivative_check_request *q, enum place place, bool *skip)
{
    const struct appearance *m = q->input.model;
    static struct derivative_check check;
    struct error err = {0};
    q->skip = skip;
    for (size_t n_path = FEW_PATH;;) {
        q->n_path = n_path;
        if (derivative_check_run(q, NULL, &check, &err) != STATUS_OK) fail_msg("%s: %s", m->id, err.text);
        print_message("%-24s %d: worst %.1e, noise %.1e +- %.0e (%s), %zu paths, %zu steps\n", m->id, (int)place,
                      check.error[check.worst], check.noise[check.worst], check.noise_se[check.worst],
                      m->param[check.worst].name, (size_t)check.n_path, (size_t)check.n_step);
        double most_noise = judge_visible(m, &check, skip);
        if (most_noise == 0.0) return;
        if (n_path == MOST_PATH) fail_msg("%s: %d paths do not show an error of %g", m->id, MOST_PATH, visible_error);
        double wanted = 1.3 * most_noise * most_noise * (double)n_path;
        n_path = (size_t)fmin(MOST_PATH, fmax(wanted, 2.0 * (double)n_path));
    }
}

/* Tables of elliptical models are sums over single rays, some of which begin to be reflected totally within a step of
 * the differences. At the upper bounds of eta and a, where most are, the differences by eta are 6 % off, and those by a
 * have too much noise for 2 %; derivatives are right for smaller steps (test_scattering, test_derivative). At a = 1 and
 * alpha = 0 the derivatives vanish, as at tau = 0. At its upper bounds microfacet_ellipse.v1 has differences by eta of
 * so much noise that 2 % do not show (test_scattering compares them). chiang_albedo.v1 has paths of thousands of steps
 * at its lower bounds, so that too few fit into the check to show 2 % of eta. */
static bool left_out(const struct appearance *m, enum place place, size_t p)
{
    const char *name = m->param[p].name;
    if (strcmp(m->id, "chiang_albedo.v1") == 0) return place == LOWER_BOUNDS && strcmp(name, "eta") == 0;
    if (strcmp(m->id, "microfacet_ellipse.v1") == 0)
        return (place == LOWER_BOUNDS && strcmp(name, "tau") == 0) ||
               (place == UPPER_BOUNDS && strcmp(name, "eta") == 0);
    if (strncmp(m->id, "elliptical", 10) != 0) return false;
    const bool ratio = strcmp(name, "a") == 0;
    return place == UPPER_BOUNDS ? ratio || strcmp(name, "eta") == 0
                                 : place == LOWER_BOUNDS && (ratio || strcmp(name, "alpha") == 0);
}

/* A comparison makes the tables of a model some hundred times, and those of elliptical_oriented.v1 take 0.4 s. */
static bool for_the_night(const struct appearance *m)
{
    return strcmp(m->id, "elliptical_oriented.v1") == 0 && !is_long_variant();
}

/* By day each model is looked at with its defaults and at one other place: dear tables at the upper bounds. */
static void every_model(void **state)
{
    struct appearance m;
    for (size_t i = 0; appearance_at(i, &m); i++) {
        if (for_the_night(&m)) continue;
        const bool upper = has_dear_tables(m.id) || i % 3 == 0;
        const enum place other = upper ? UPPER_BOUNDS : i % 3 == 1 ? LOWER_BOUNDS : CLEAR_CLOTH;
        for (enum place place = LOWER_BOUNDS; place < N_PLACE; place++) {
            double param[SCATTERING_MAX_PARAM];
            bool skip[SCATTERING_MAX_PARAM];
            if (!is_long_variant() && place != DEFAULTS && place != other) continue;
            place_parameters(&m, place, param);
            for (size_t p = 0; p < m.n_param; p++)
                skip[p] = left_out(&m, place, p) || is_other_channel(m.id, &m.param[p], (size_t)place);
            struct derivative_check_request q = request(*state, &m, param);
            check_until_visible(&q, place, skip);
        }
    }
}

/* Two sets of different values, for the warp and the weft. The tracer finds the set of a step in the same way for every
 * model, so the first model is looked at with all parameters of both sets, the others with each parameter of one of
 * them, in turns, and those with dear tables with one parameter of each set. */
static void every_model_with_two_sets(void **state)
{
    const struct fixture *x = *state;
    struct appearance m;
    for (size_t i = 0; appearance_at(i, &m); i++) {
        double param[2 * SCATTERING_MAX_PARAM];
        static struct derivative_check check;
        struct error err = {0};
        if (for_the_night(&m)) continue;
        for (size_t p = 0; p < m.n_param; p++) {
            param[p] = m.param[p].start;
            param[m.n_param + p] = 0.8 * m.param[p].start + 0.2 * m.param[p].lower;
        }
        struct derivative_check_request q = request(x, &m, param);
        bool skip[2 * SCATTERING_MAX_PARAM];
        for (size_t p = 0; p < 2 * m.n_param; p++)
            skip[p] =
                has_dear_tables(m.id) ? p != 0 && p != m.n_param + 1 : i > 0 && p % m.n_param % 2 != p / m.n_param;
        q.skip = skip;
        q.input.scene.fibers = x->two_groups;
        q.input.n_set = 2;
        status s = derivative_check_run(&q, NULL, &check, &err);
        assert_int_equal(s, m.kind == MODEL_SURFACE ? STATUS_OK : STATUS_INVALID);
        if (s != STATUS_OK) continue;
        assert_int_equal(check.n_param, 2 * m.n_param);
        for (size_t p = 0; p < 2 * m.n_param; p++) {
            if (skip[p]) continue;
            assert_true(check.checked[p] && check.noise_se[p] > 0.0);
            if (check.error[p] > tolerance(&check, p)) fail_of(&check, p, &m);
        }
    }
}

/* ---- a model whose derivatives are wrong ---- */

static struct {
    const struct scattering_model *right;
    float factor[SCATTERING_MAX_PARAM];
} fault;

static void wrong_scores(float *score)
{
    for (size_t k = 0; score != NULL && k < 3 * fault.right->n_param; k++)
        score[k] *= fault.factor[k % fault.right->n_param];
}

static void wrong_eval(const struct scattering_state *s, const float wi[3], const float wo[3], float rgb[3],
                       float *score)
{
    fault.right->eval(s, wi, wo, rgb, score);
    wrong_scores(score);
}

static float wrong_eval_pdf(const struct scattering_state *s, const float wi[3], const float wo[3],
                            const float *weight_rgb, float rgb[3], float *score)
{
    float pdf = fault.right->eval_pdf(s, wi, wo, weight_rgb, rgb, score);
    wrong_scores(score);
    return pdf;
}

/* The model with scores that are too large: by parameter i_param, or by each for EVERY. A parameter's figures in a
 * check follow from its own scores alone. */
enum { EVERY = SCATTERING_MAX_PARAM };
static struct scattering_model faulty_model(const char *id, size_t i_param, float factor)
{
    struct scattering_model wrong = *scattering_find(id);
    fault.right = scattering_find(id);
    for (size_t p = 0; p < SCATTERING_MAX_PARAM; p++)
        fault.factor[p] = i_param == EVERY || i_param == p ? factor : 1.0f;
    wrong.eval = wrong_eval;
    wrong.eval_pdf = wrong_eval_pdf;
    wrong.view_of = NULL;
    return wrong;
}

static void wrong_scores_are_found(void **state)
{
    const struct fixture *x = *state;
    struct scattering_model wrong = faulty_model("two_lobe.v1", 6, 1.05f);
    struct appearance m;
    struct derivative_check check, again;
    double param[SCATTERING_MAX_PARAM];
    bool skip[SCATTERING_MAX_PARAM] = {false};
    appearance_from_surface(&wrong, &m);
    for (size_t p = 0; p < m.n_param; p++) param[p] = m.param[p].start;
    struct derivative_check_request q = request(x, &m, param);
    assert_int_equal(derivative_check_run(&q, NULL, &check, NULL), STATUS_OK);
    assert_int_equal(check.worst, 6);
    assert_true(fabs(check.error[6] / 0.05 - 1.0) < 0.1); /* of 1.05 times the slope: 0.048 */
    assert_int_equal(derivative_check_run(&q, NULL, &again, NULL), STATUS_OK);
    assert_memory_equal(&check, &again, sizeof check);
    skip[6] = true;
    q.skip = skip;
    assert_int_equal(derivative_check_run(&q, NULL, &check, NULL), STATUS_OK);
    assert_true(!check.checked[6] && check.error[6] == 0.0 && check.error[check.worst] < 2e-3);
}

/* At the upper bounds of textile.v3, where differences are noisiest. Hardly any light is in the lobe TT there, so its
 * widths, which hardly act, are left out: their errors refer to a least slope (derivative_check.h). */
static void small_faults_at_the_bounds_are_found(void **state)
{
    enum { P_BETA_TT = 7, P_GAMMA_TT = 8 };
    const struct fixture *x = *state;
    const struct scattering_model wrong = faulty_model("textile.v3", EVERY, 1.02f);
    static struct derivative_check check;
    struct appearance m;
    double param[SCATTERING_MAX_PARAM];
    bool skip[SCATTERING_MAX_PARAM] = {[P_BETA_TT] = true, [P_GAMMA_TT] = true};
    appearance_from_surface(&wrong, &m);
    place_parameters(&m, UPPER_BOUNDS, param);
    struct derivative_check_request q = request(x, &m, param);
    q.skip = skip;
    q.n_path = MOST_PATH;
    assert_int_equal(derivative_check_run(&q, NULL, &check, NULL), STATUS_OK);
    for (size_t p = 0; p < m.n_param; p++)
        if (!skip[p] && !(check.error[p] > fmin(tolerance(&check, p), visible_error))) /* a fault scatters, too */
            fail_of(&check, p, &m);
}

/* ---- many rows, two paths for each ---- */

enum { N_ROW = 1024 };

static void check_many_rows(const struct fixture *x, const struct appearance *m, enum place place, uint64_t seed,
                            struct derivative_check *check)
{
    static struct configuration row[N_ROW];
    double param[SCATTERING_MAX_PARAM];
    for (size_t i = 0; i < N_ROW; i++) row[i] = x->c[i % N_CONFIGURATION];
    place_parameters(m, place, param);
    struct derivative_check_request q = request(x, m, param);
    q.configuration = row;
    q.n_configuration = N_ROW;
    q.seed = seed;
    assert_int_equal(derivative_check_run(&q, NULL, check, NULL), STATUS_OK);
    assert_int_equal(check->n_path, 2 * N_ROW);
}

/* At the upper bounds of textile.v3, as above, noise alone gives errors of 4 % (beta_TT), which is many of its standard
 * deviations and no fault. */
static void noise_of_many_rows_is_no_fault(void **state)
{
    enum { P_BETA_TT = 7 };
    static struct derivative_check check;
    struct appearance m;
    assert_true(appearance_find("textile.v3", &m));
    for (uint64_t seed = 1; seed <= 2; seed++) {
        check_many_rows(*state, &m, UPPER_BOUNDS, seed, &check);
        assert_true(check.error[P_BETA_TT] - 3.0 * check.noise_se[P_BETA_TT] > 0.01);
        for (size_t p = 0; p < m.n_param; p++)
            if (check.error[p] > tolerance(&check, p)) fail_of(&check, p, &m);
        assert_true(derivative_check_excess(&check, check.worst) < rounding);
    }
}

/* The misses of a fault scatter as the derivatives of single paths do. That must not pass for noise. A single fault
 * would be the worst parameter. */
static void small_faults_of_many_rows_are_found(void **state)
{
    static struct derivative_check right, check;
    const struct scattering_model wrong = faulty_model("textile.v3", EVERY, 1.02f);
    struct appearance m;
    assert_true(appearance_find("textile.v3", &m));
    check_many_rows(*state, &m, DEFAULTS, 1, &right);
    appearance_from_surface(&wrong, &m);
    check_many_rows(*state, &m, DEFAULTS, 1, &check);
    for (size_t p = 0; p < m.n_param; p++) {
        double excess = derivative_check_excess(&check, p);
        if (!(excess > fmax(visible_error, derivative_check_excess(&right, right.worst)))) fail_of(&check, p, &m);
    }
}

static void bad_requests(void **state)
{
    const struct fixture *x = *state;
    struct appearance m;
    struct derivative_check check;
    struct error err = {0};
    double param[SCATTERING_MAX_PARAM];
    volatile bool cancel = true;
    assert_true(appearance_at(0, &m));
    for (size_t p = 0; p < m.n_param; p++) param[p] = m.param[p].start;
    struct derivative_check_request q = request(x, &m, param);
    q.input.scene.fibers = NULL;
    assert_int_equal(derivative_check_run(&q, NULL, &check, &err), STATUS_INVALID);
    q = request(x, &m, param);
    assert_int_equal(derivative_check_run(&q, &(struct progress){.cancel = (void *)(uintptr_t)&cancel}, &check, &err),
                     STATUS_CANCELLED);
    param[0] = NAN;
    assert_int_equal(derivative_check_run(&q, NULL, &check, &err), STATUS_INVALID);
    assert_string_equal(err.field, m.param[0].name);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(every_model),
                                       cmocka_unit_test(every_model_with_two_sets),
                                       cmocka_unit_test(wrong_scores_are_found),
                                       cmocka_unit_test(small_faults_at_the_bounds_are_found),
                                       cmocka_unit_test(noise_of_many_rows_is_no_fault),
                                       cmocka_unit_test(small_faults_of_many_rows_are_found),
                                       cmocka_unit_test(bad_requests)};
    return cmocka_run_group_tests(tests, setup, teardown);
}
