/* Cloths of several fiber groups, each with a parameter set of its own. Equal sets give the result of one set, and
 * derivatives are by the parameters of their set. */
#include "base/angle.h"
#include "renderer/estimate/estimate.h"
#include "renderer/estimate/render.h"
#include "renderer/transport/camera.h"
#include "renderer/transport/surface/path_tracer.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/tracer/orbit_configurations.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { N_PARAM = 9 };
static const double set[2][N_PARAM] = {
    {0.2, 0.1, 0.3, 0.8, 0.6, 0.4, 4 * RAD_PER_DEG, 14 * RAD_PER_DEG, 20 * RAD_PER_DEG},
    {0.4, 0.5, 0.1, 0.5, 0.9, 0.7, 7 * RAD_PER_DEG, 25 * RAD_PER_DEG, 12 * RAD_PER_DEG}};
static struct scene *one, *two; /* all fibers in one group; warp and weft apart */
static struct configuration configuration[16];

static int set_up(void **state)
{
    (void)state;
    struct fiber_set f;
    orbit_configurations_16(configuration);
    hand_weave_small(&f);
    status st = scene_new(&f, &(struct scene_option){.black_sheet = true}, &one, NULL);
    memcpy(f.group, f.axis_class, f.n_fiber);
    if (st == STATUS_OK) st = scene_new(&f, &(struct scene_option){.black_sheet = true}, &two, NULL);
    fiber_set_release(&f);
    return st != STATUS_OK;
}

static int tear_down(void **state)
{
    (void)state;
    scene_free(one);
    scene_free(two);
    return 0;
}

static struct estimate run(const struct scene *scene, const double *param, size_t n_set, int i_configuration,
                           size_t n_path)
{
    struct estimate e;
    struct error err = {0};
    struct appearance model;
    struct estimate_request q = {.input = trace_input_surface(scene, scattering_find("two_lobe.v1"), param, &model),
                                 .configuration = &configuration[i_configuration],
                                 .n_configuration = 1,
                                 .n_path = &n_path,
                                 .seed = 31};
    q.input.want_derivative = true;
    q.input.n_set = n_set;
    if (estimate_run(&q, NULL, NULL, &e, &err) != STATUS_OK) fail_msg("%s", err.text);
    return e;
}

static void equal_sets_are_one_set(void **state)
{
    (void)state;
    double twice[2 * N_PARAM];
    for (int i = 0; i < 2; i++) memcpy(twice + i * N_PARAM, set[0], sizeof set[0]);
    assert_int_equal(scene_n_group(one), 1);
    assert_int_equal(scene_n_group(two), 2);
    for (int i = 0; i < 16; i += 5) {
        struct estimate a = run(one, set[0], 0, i, 8192), b = run(two, twice, 2, i, 8192),
                        c = run(two, set[0], 1, i, 8192);
        assert_memory_equal(&a, &c, sizeof a);
        assert_memory_equal(a.mean, b.mean, sizeof a.mean);
        assert_memory_equal(a.var, b.var, sizeof a.var);
        for (int k = 0; k < 3; k++)
            for (int p = 0; p < N_PARAM; p++) {
                double all = a.jac[k * N_PARAM + p], first = b.jac[k * 2 * N_PARAM + p],
                       second = b.jac[k * 2 * N_PARAM + N_PARAM + p];
                if (!(fabs(first + second - all) <= 2e-6 * (fabs(first) + fabs(second)) + 1e-7 * a.mean[k] / set[0][p]))
                    fail_msg("configuration %d, parameter %d, channel %d: %g + %g is not %g", i, p, k, first, second,
                             all);
                if (all != 0) assert_true(first != 0 && second != 0);
            }
    }
}

/* Sets that no fiber uses have no effect. */
static void unused_sets_have_no_effect(void **state)
{
    (void)state;
    struct fiber_set f;
    struct scene *scene = NULL;
    struct error err = {0};
    double param[3 * N_PARAM];
    memcpy(param, set[1], sizeof set[1]);
    memcpy(param + N_PARAM, set[0], sizeof set[0]);
    memcpy(param + 2 * N_PARAM, set[1], sizeof set[1]);
    hand_weave_small(&f);
    memset(f.group, 1, f.n_fiber);
    assert_int_equal(scene_new(&f, &(struct scene_option){.black_sheet = true}, &scene, &err), STATUS_OK);
    assert_int_equal(scene_n_group(scene), 2);
    struct estimate a = run(one, set[0], 1, 1, 2048), b = run(scene, param, 3, 1, 2048);
    assert_memory_equal(a.mean, b.mean, sizeof a.mean);
    for (int k = 0; k < 3; k++)
        for (int p = 0; p < N_PARAM; p++) {
            assert_true(b.jac[k * 3 * N_PARAM + N_PARAM + p] == a.jac[k * N_PARAM + p]);
            assert_true(b.jac[k * 3 * N_PARAM + p] == 0 && b.jac[k * 3 * N_PARAM + 2 * N_PARAM + p] == 0);
        }
    scene_free(scene);
    scene = NULL;
    f.group[0] = FIBER_MAX_GROUP;
    assert_int_equal(scene_new(&f, &(struct scene_option){0}, &scene, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "fiber 0 has group 8"));
    fiber_set_release(&f);
}

static void bad_sets_are_refused(void **state)
{
    (void)state;
    struct fiber_set f;
    struct scene *scene = NULL;
    struct error err = {0};
    struct estimate e;
    const size_t n_path = 256;
    double param[8 * N_PARAM];
    for (int i = 0; i < 8; i++) memcpy(param + i * N_PARAM, set[0], sizeof set[0]);
    hand_weave_small(&f);
    f.group[3] = 2; /* a third group */
    assert_int_equal(scene_new(&f, &(struct scene_option){0}, &scene, &err), STATUS_OK);
    struct appearance model;
    struct estimate_request q = {.input = trace_input_surface(scene, scattering_find("two_lobe.v1"), param, &model),
                                 .configuration = configuration,
                                 .n_configuration = 1,
                                 .n_path = &n_path};
    q.input.n_set = 2;
    assert_int_equal(estimate_run(&q, NULL, NULL, &e, &err), STATUS_INVALID);
    assert_string_equal(err.field, "n_set");
    q.input.n_set = 8; /* 72 parameters */
    assert_int_equal(estimate_run(&q, NULL, NULL, &e, &err), STATUS_INVALID);
    q.input.n_set = 7;
    q.input.want_derivative = true;
    assert_int_equal(estimate_run(&q, NULL, NULL, &e, &err), STATUS_OK);
    q.input.n_set = 3;
    param[2 * N_PARAM + 4] = 7;
    assert_int_equal(estimate_run(&q, NULL, NULL, &e, &err), STATUS_INVALID);
    scene_free(scene);
    fiber_set_release(&f);
}

enum { N_PATH = 3000, STEP_CAPACITY = 200000 };

/* Radiance of recorded paths at other parameters, as path_tracer.h states it. */
static void evaluate(const double param[2][N_PARAM], const struct path_record *record, size_t n_record, double out[3])
{
    const struct scattering_model *m = scattering_find("two_lobe.v1");
    struct scattering_state *s[2] = {NULL, NULL};
    for (int i = 0; i < 2; i++) assert_int_equal(m->prepare(param[i], &s[i], NULL), STATUS_OK);
    memset(out, 0, 3 * sizeof *out);
    for (size_t i = 0; i < n_record; i++) {
        double t[3] = {1, 1, 1};
        for (size_t k = 0; k < record[i].n_step; k++) {
            const struct path_step *p = &record[i].step[k];
            float rgb[3];
            if (p->light > 0) {
                m->eval(s[p->i_group], p->light_wi, p->wo, rgb, NULL);
                for (int c = 0; c < 3; c++) out[c] += t[c] * (double)rgb[c] * (double)p->light;
            }
            if (p->image[0] > 0) {
                m->eval(s[p->i_group], p->image_wi, p->wo, rgb, NULL);
                for (int c = 0; c < 3; c++) out[c] += t[c] * (double)rgb[c] * (double)p->image[c];
            }
            if (p->guided_light > 0) {
                float ahead[3];
                m->eval(s[p->i_group], p->guided_wi, p->wo, rgb, NULL);
                m->eval(s[p->i_guided_group], p->guided_light_wi, p->guided_wo, ahead, NULL);
                for (int c = 0; c < 3; c++)
                    out[c] += t[c] * (double)rgb[c] * (double)ahead[c] * (double)p->guided_light;
            }
            m->eval(s[p->i_group], p->wi, p->wo, rgb, NULL);
            for (int c = 0; c < 3; c++) {
                t[c] *= (double)rgb[c] * (double)p->weight;
                out[c] += t[c] * (double)p->escape[c];
            }
        }
    }
    for (int i = 0; i < 2; i++) m->release(s[i]);
}

static struct environment *sky(void)
{
    struct image im;
    struct environment *e = NULL;
    assert_int_equal(image_init(&im, 8, 4, 3, NULL), STATUS_OK);
    for (size_t i = 0; i < 3 * 32; i++) im.pixel[i] = 0.1f + (i % 7 == 0 ? 1.0f : 0);
    assert_int_equal(environment_new(&im, 1, &e, NULL), STATUS_OK);
    image_release(&im);
    return e;
}

/* All 18 derivatives against differences on the same recorded paths; lamp and picture together. */
static void recorded_paths_of_two_sets(void **state)
{
    (void)state;
    const struct scattering_model *m = scattering_find("two_lobe.v1");
    static struct path_record record[N_PATH];
    struct path_step *steps = malloc(STEP_CAPACITY * sizeof *steps), *next = steps, *end = steps + STEP_CAPACITY;
    struct environment *e = sky();
    assert_non_null(steps);
    for (int v = 1; v < 16; v += 7) {
        struct configuration c = configuration[v];
        struct parameter_sets sets;
        struct path_setting setting;
        struct camera camera;
        double value[3] = {0}, jac[PATH_N_DERIVATIVE] = {0}, again[3];
        size_t n_record = 0;
        c.environment = e;
        next = steps;
        assert_int_equal(parameter_sets_init(&sets, two, m, set[0], 2, NULL), STATUS_OK);
        path_setting_init_sets(&setting, two, &sets, &c, true);
        camera_init(&camera, &c);
        for (uint32_t i = 0; i < N_PATH; i++) {
            struct rng r;
            struct scene_ray ray;
            struct path_result path;
            struct path_record rec = {0, (size_t)(end - next), next};
            rng_start(&r, &(struct rng_key){22, 0, 0, 0}, i, 0);
            const double x = rng_double(&r), xy[2] = {x, rng_double(&r)};
            assert_true(camera_ray(&camera, two, xy, &ray));
            path_trace(&setting, &ray, &r, &path, &rec);
            if (rec.n_step > rec.capacity) break;
            for (int k = 0; k < 3; k++) value[k] += (double)path.radiance[k];
            for (size_t k = 0; k < 6 * N_PARAM; k++) jac[k] += (double)path.jac[k];
            record[n_record++] = rec;
            next += rec.n_step;
        }
        parameter_sets_release(&sets);
        assert_true(n_record > N_PATH / 2);
        evaluate(set, record, n_record, again);
        for (int k = 0; k < 3; k++) assert_true(fabs(again[k] / value[k] - 1) < 1e-4);
        for (size_t p = 0; p < 2 * N_PARAM; p++) {
            double moved[2][N_PARAM], up[3], down[3], *at = &moved[p / N_PARAM][p % N_PARAM],
                                                      h = 3e-3 * set[p / N_PARAM][p % N_PARAM];
            memcpy(moved, set, sizeof moved);
            *at += h;
            evaluate((const double(*)[N_PARAM])moved, record, n_record, up);
            *at -= 2 * h;
            evaluate((const double(*)[N_PARAM])moved, record, n_record, down);
            for (size_t k = 0; k < 3; k++) {
                double fd = (up[k] - down[k]) / (2 * h), got = jac[k * 2 * N_PARAM + p], scale = value[k] / (h / 3e-3);
                if (fabs(fd - got) > 1e-3 * fabs(got) + 1e-4 * scale)
                    fail_msg("view %d, set %zu, %s, channel %zu: %.6g, difference %.6g", v, p / N_PARAM,
                             m->param[p % N_PARAM].name, k, got, fd);
            }
        }
    }
    environment_free(e);
    free(steps);
}

static void pictures_name_their_layers(void **state)
{
    (void)state;
    struct image im;
    struct error err = {0};
    struct appearance model;
    struct render_request q = {.input = trace_input_surface(two, scattering_find("two_lobe.v1"), set[0], &model),
                               .configuration = configuration,
                               .width = 4,
                               .height = 4,
                               .n_sample = 4,
                               .seed = 1};
    q.input.want_derivative = true;
    q.input.n_set = 2;
    if (render_run(&q, NULL, NULL, &im, &err) != STATUS_OK) fail_msg("%s", err.text);
    assert_int_equal(im.n_channel, 6 + 3 * 2 * N_PARAM);
    assert_string_equal(im.channel_name[6], "d_set0.C_R.r.R");
    assert_string_equal(im.channel_name[6 + 3 * (N_PARAM + 6) + 1], "d_set1.beta_R.G");
    image_release(&im);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(equal_sets_are_one_set),     cmocka_unit_test(unused_sets_have_no_effect),
        cmocka_unit_test(bad_sets_are_refused),       cmocka_unit_test(recorded_paths_of_two_sets),
        cmocka_unit_test(pictures_name_their_layers),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
