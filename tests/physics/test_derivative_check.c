/* The gradient certificate: every model passes it at its defaults and at its bounds, and wrong derivatives fail it. */
#include "renderer/transport/derivative_check.h"
#include "tests/support/cloth/hand_volume.h"
#include "tests/support/cloth/hand_weave.h"
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
    struct configuration c[16];
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

static struct derivative_check_request request(const struct fixture *x, const struct appearance *m, const double *param)
{
    const struct appearance_scene scene = {.fibers = x->scene, .volume = &x->volume};
    return (struct derivative_check_request){.input = {.scene = scene, .model = m, .param = param},
                                             .configuration = x->c,
                                             .n_configuration = 16,
                                             .n_path = 2048,
                                             .seed = 3,
                                             .replica = 5};
}

static void every_model(void **state)
{
    const struct fixture *x = *state;
    struct appearance m;
    for (size_t i = 0; appearance_at(i, &m); i++) {
        for (int place = 0; place < 4; place++) { /* lower bounds, defaults, upper bounds, clear cloth */
            double param[SCATTERING_MAX_PARAM];
            struct derivative_check check;
            struct error err = {0};
            for (size_t p = 0; p < m.n_param; p++)
                param[p] = place == 0 ? m.param[p].lower : place == 2 ? m.param[p].upper : m.param[p].start;
            if (place == 3) /* the first colour at its lower bound beside bright ones, so that paths are long */
                for (size_t p = 0; p < m.n_param; p++)
                    if (m.param[p].channel >= 0) param[p] = p < 3 ? m.param[p].lower : 0.9;
            if (place == 0 || place == 2) /* not the bounds of colours: a white path never ends, black has no light */
                for (size_t p = 0; p < m.n_param; p++)
                    if (m.param[p].channel >= 0) param[p] = place == 0 ? 0.2 : 0.9;
            if (m.kind == MODEL_VOLUME) param[m.n_param - 1] = m.param[m.n_param - 1].start;
            struct derivative_check_request q = request(x, &m, param);
            if (derivative_check_run(&q, NULL, &check, &err) != STATUS_OK) fail_msg("%s: %s", m.id, err.text);
            print_message("%-24s %d: worst %.1e +- %.0e (%s), %zu paths, %zu steps\n", m.id, place,
                          check.error[check.worst], check.error_se[check.worst], m.param[check.worst].name,
                          (size_t)check.n_path, (size_t)check.n_step);
            /* some 400 errors are looked at: 3.5 standard errors let one test in ten thousand fail by chance */
            for (size_t p = 0; p < m.n_param; p++)
                if (check.error[p] > 2e-3 + 3.5 * check.error_se[p])
                    fail_msg("%s, %s: %.2g +- %.1g", m.id, m.param[p].name, check.error[p], check.error_se[p]);
        }
    }
}

/* Two sets of different values, for the warp and the weft. */
static void every_model_with_two_sets(void **state)
{
    const struct fixture *x = *state;
    struct appearance m;
    for (size_t i = 0; appearance_at(i, &m); i++) {
        double param[2 * SCATTERING_MAX_PARAM];
        static struct derivative_check check;
        struct error err = {0};
        for (size_t p = 0; p < m.n_param; p++) {
            param[p] = m.param[p].start;
            param[m.n_param + p] = 0.8 * m.param[p].start + 0.2 * m.param[p].lower;
        }
        struct derivative_check_request q = request(x, &m, param);
        q.input.scene.fibers = x->two_groups;
        q.input.n_set = 2;
        status s = derivative_check_run(&q, NULL, &check, &err);
        assert_int_equal(s, m.kind == MODEL_SURFACE ? STATUS_OK : STATUS_INVALID);
        if (s != STATUS_OK) continue;
        assert_int_equal(check.n_param, 2 * m.n_param);
        for (size_t p = 0; p < 2 * m.n_param; p++) {
            assert_true(check.checked[p] && check.error_se[p] > 0.0);
            if (check.error[p] > 2e-3 + 2.0 * check.error_se[p])
                fail_msg("%s, set %zu, %s: %.2g +- %.1g", m.id, p / m.n_param, m.param[p % m.n_param].name,
                         check.error[p], check.error_se[p]);
        }
    }
}

/* ---- a model whose derivatives are wrong ---- */

static void wrong_scores(float *score)
{
    for (int c = 0; score != NULL && c < 3; c++) score[c * 9 + 6] *= 1.05f;
}

static void wrong_eval(const struct scattering_state *s, const float wi[3], const float wo[3], float rgb[3],
                       float *score)
{
    scattering_find("two_lobe.v1")->eval(s, wi, wo, rgb, score);
    wrong_scores(score);
}

static float wrong_eval_pdf(const struct scattering_state *s, const float wi[3], const float wo[3],
                            const float *weight_rgb, float rgb[3], float *score)
{
    float pdf = scattering_find("two_lobe.v1")->eval_pdf(s, wi, wo, weight_rgb, rgb, score);
    wrong_scores(score);
    return pdf;
}

static void wrong_scores_are_found(void **state)
{
    const struct fixture *x = *state;
    struct scattering_model wrong = *scattering_find("two_lobe.v1");
    struct appearance m;
    struct derivative_check check, again;
    double param[SCATTERING_MAX_PARAM];
    bool skip[SCATTERING_MAX_PARAM] = {false};
    wrong.eval = wrong_eval;
    wrong.eval_pdf = wrong_eval_pdf;
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
    const struct CMUnitTest tests[] = {cmocka_unit_test(every_model), cmocka_unit_test(every_model_with_two_sets),
                                       cmocka_unit_test(wrong_scores_are_found), cmocka_unit_test(bad_requests)};
    return cmocka_run_group_tests(tests, setup, teardown);
}
