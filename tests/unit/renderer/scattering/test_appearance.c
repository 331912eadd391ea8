/* The list of models for fits, and their estimates, which must agree with direct use of the tracers. */
#include "renderer/estimate/estimate.h"
#include "renderer/scattering/appearance.h"
#include "renderer/transport/camera.h"
#include "renderer/transport/surface/path_tracer.h"
#include "renderer/transport/volume/volume_tracer.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/scan/hand_volume.h"
#include "tests/support/tracer/orbit_configurations.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { SEED = 3 };

static void test_ids_are_unique_and_found(void **unused)
{
    (void)unused;
    struct appearance a, b;
    size_t n = 0;
    for (; appearance_at(n, &a); n++) {
        assert_true(appearance_find(a.id, &b));
        assert_string_equal(a.id, b.id); /* a second model of the same id would be found instead of this one */
        assert_int_equal(a.kind, b.kind);
        assert_ptr_equal(a.surface, b.surface);
        assert_ptr_equal(a.volume, b.volume);
        assert_true(a.n_param >= 1 && a.n_param <= SCATTERING_MAX_PARAM);
        for (size_t p = 0; p < a.n_param; p++) {
            assert_int_equal(appearance_param_index(&a, a.param[p].name), p);
            assert_true(a.param[p].lower < a.param[p].upper);
            assert_true(a.param[p].start >= a.param[p].lower && a.param[p].start <= a.param[p].upper);
        }
    }
    assert_true(n >= 4);
    assert_false(appearance_find("no_such_model.v1", &b));
    assert_int_equal(appearance_param_index(&a, "no_such_parameter"), -1);
}

static void test_volume_models_end_with_the_density_multiplier(void **unused)
{
    (void)unused;
    struct appearance a;
    for (size_t i = 0; appearance_at(i, &a); i++) {
        int d = appearance_param_index(&a, MODEL_DENSITY_MULTIPLIER);
        if (a.kind == MODEL_SURFACE) {
            assert_int_equal(d, -1);
            continue;
        }
        assert_int_equal(d, a.n_param - 1);
        assert_true(param_to_file_unit(&a.param[d], a.param[d].start) == 4000.0); /* per cm */
        assert_true(param_from_file_unit(&a.param[d], 4000.0) == 4e5);            /* per m */
    }
}

static void request_init(struct estimate_request *q, const struct appearance *a, double *param,
                         const struct configuration *c, const size_t *n_path)
{
    for (size_t p = 0; p < a->n_param; p++) param[p] = a->param[p].start;
    *q = (struct estimate_request){.input = {.model = a, .param = param, .want_derivative = true},
                                   .configuration = c,
                                   .n_configuration = 2,
                                   .n_path = n_path,
                                   .seed = SEED};
}

/* The paths of an estimate, traced one by one by direct calls of the tracer. */
struct by_hand {
    const struct scene *fibers;
    const struct volume_scene *volume;
    const struct appearance *model;
    const double *param;
    const struct configuration *c;
    uint32_t n_path;
    double mean_green;
};

static void start_path(uint32_t i, struct rng *rng, double xy[2])
{
    rng_start(rng, &(struct rng_key){.seed = SEED}, i / RADIANCE_BLOCK_PATHS, i % RADIANCE_BLOCK_PATHS);
    for (int a = 0; a < 2; a++) xy[a] = rng_double(rng);
}

static void trace_fibers(void *context, size_t i_task, size_t i_thread)
{
    struct by_hand *h = context;
    struct parameter_sets sets;
    struct path_setting setting;
    struct camera camera;
    (void)i_task, (void)i_thread;
    assert_int_equal(parameter_sets_init(&sets, h->fibers, h->model->surface, h->param, 1, NULL), STATUS_OK);
    path_setting_init_sets(&setting, h->fibers, &sets, h->c, true);
    camera_init(&camera, h->c);
    for (uint32_t i = 0; i < h->n_path; i++) {
        struct rng rng;
        struct scene_ray ray;
        struct path_result path;
        double xy[2];
        start_path(i, &rng, xy);
        assert_true(camera_ray(&camera, h->fibers, xy, &ray));
        path_trace(&setting, &ray, &rng, &path, NULL);
        h->mean_green += (double)path.radiance[1] / h->n_path;
    }
    parameter_sets_release(&sets);
}

static void trace_volume(void *context, size_t i_task, size_t i_thread)
{
    struct by_hand *h = context;
    const struct appearance *m = h->model;
    struct volume_parameters parameters = {.model = m->volume, .multiplier_per_m = h->param[m->n_param - 1]};
    struct volume_setting setting;
    struct camera camera;
    (void)i_task, (void)i_thread;
    assert_int_equal(m->volume->prepare(h->param, &parameters.state, NULL), STATUS_OK);
    volume_setting_init(&setting, h->volume, &parameters, h->c, true);
    camera_init(&camera, h->c);
    for (uint32_t i = 0; i < h->n_path; i++) {
        struct rng rng;
        struct volume_ray ray;
        struct volume_result path;
        double xy[2], origin_mm[3], direction[3];
        start_path(i, &rng, xy);
        camera_origin(&camera, xy, origin_mm);
        camera_direction(&camera, xy, direction);
        assert_true(volume_ray_enter(h->volume, origin_mm, direction, &ray));
        volume_trace(&setting, &ray, &rng, &path, NULL);
        h->mean_green += (double)path.radiance[1] / h->n_path;
    }
    m->volume->release(parameters.state);
}

/* Compares inside a thread pool, because its threads round small numbers in the same way as estimates do. */
static void same_by_hand(const struct estimate *e, const struct estimate_request *q, task_function trace)
{
    struct by_hand h = {.fibers = q->input.scene.fibers,
                        .volume = q->input.scene.volume,
                        .model = q->input.model,
                        .param = q->input.param,
                        .c = q->configuration,
                        .n_path = (uint32_t)e->n_path};
    assert_int_equal(thread_pool_run(NULL, 1, trace, &h, NULL), STATUS_OK);
    if (!(fabs(e->mean[1] / h.mean_green - 1.0) < 1e-12)) fail_msg("%.17g, by hand %.17g", e->mean[1], h.mean_green);
}

static void test_same_figures_as_the_tracers(void **unused)
{
    (void)unused;
    struct fiber_set f;
    struct direction_volume v;
    struct scene *scene = NULL;
    struct volume_scene volume;
    struct configuration c[16];
    struct appearance a;
    struct estimate_request q;
    struct estimate e[2];
    struct error err;
    double param[SCATTERING_MAX_PARAM];
    const size_t n_path[2] = {512, 256}, n[3] = {16, 16, 8};
    const struct scene_option option = {.black_sheet = true};
    const struct volume_scene_option volume_option = {.black_sheet = true};
    orbit_configurations_16(c);
    hand_weave_small(&f);
    hand_volume_weave(&v, n, 4e-6, 0.4);
    assert_int_equal(scene_new(&f, &option, &scene, NULL), STATUS_OK);
    assert_int_equal(volume_scene_init(&volume, &v, &volume_option, NULL), STATUS_OK);

    appearance_at(0, &a);
    request_init(&q, &a, param, c, n_path);
    q.input.scene.fibers = scene;
    assert_int_equal(estimate_run(&q, NULL, NULL, e, NULL), STATUS_OK);
    same_by_hand(&e[0], &q, trace_fibers);

    appearance_from_volume(phase_registry()[0], &a);
    request_init(&q, &a, param, c, n_path);
    assert_int_equal(estimate_run(&q, NULL, NULL, e, &err), STATUS_INVALID); /* no volume given */
    assert_non_null(strstr(err.text, a.id));
    q.input.scene.volume = &volume;
    assert_int_equal(estimate_run(&q, NULL, NULL, e, NULL), STATUS_OK);
    same_by_hand(&e[0], &q, trace_volume);

    volume_scene_release(&volume);
    scene_free(scene);
    fiber_set_release(&f);
    direction_volume_release(&v);
}

/* The mean over rotations against estimates with the cloth turned by the test. A configuration without this option in
 * the same request does not change. */
static void test_mean_over_rotations(void **unused)
{
    (void)unused;
    enum { N_ROTATION = 5, N = N_ROTATION + 1 };
    struct thread_pool *pool = NULL;
    struct fiber_set f;
    struct scene *scene = NULL;
    struct configuration c[16], by_hand[N];
    struct appearance a;
    struct estimate_request q;
    struct estimate mean[2], turned[N];
    double param[SCATTERING_MAX_PARAM], sum = 0.0, var = 0.0;
    const size_t n_path[2] = {N_ROTATION * 512, 256}, n_turned[N] = {512, 512, 512, 512, 512, 256};
    orbit_configurations_16(c);
    hand_weave_small(&f);
    assert_int_equal(thread_pool_new(2, &pool, NULL), STATUS_OK);
    assert_int_equal(scene_new(&f, &(struct scene_option){.black_sheet = true}, &scene, NULL), STATUS_OK);
    appearance_at(0, &a);
    for (int k = 0; k < N; k++) by_hand[k] = c[k < N_ROTATION ? 1 : 0];
    for (int k = 0; k < N_ROTATION; k++)
        by_hand[k].cloth_rotation_rad = c[1].cloth_rotation_rad + k * 2.0 * M_PI / N_ROTATION;
    request_init(&q, &a, param, by_hand, n_turned);
    q.input.scene.fibers = scene;
    q.n_configuration = N;
    assert_int_equal(estimate_run(&q, pool, NULL, turned, NULL), STATUS_OK);

    struct configuration wanted[2] = {c[1], c[0]};
    wanted[0].n_rotation = N_ROTATION;
    q.configuration = wanted;
    q.n_configuration = 2;
    q.n_path = n_path;
    assert_int_equal(estimate_run(&q, pool, NULL, mean, NULL), STATUS_OK);
    assert_memory_equal(&mean[1], &turned[N_ROTATION], sizeof mean[1]);
    double least = INFINITY, most = 0.0;
    for (int k = 0; k < N_ROTATION; k++) {
        least = fmin(least, turned[k].mean[1]);
        most = fmax(most, turned[k].mean[1]);
        sum += turned[k].mean[1] / N_ROTATION;
        var += turned[k].var[1] / (N_ROTATION * N_ROTATION);
    }
    assert_true(most - least > 0.05 * sum); /* the rotations differ, so that one of them is not their mean */
    assert_true(fabs(mean[0].mean[1] - sum) < 1e-12 && fabs(mean[0].var[1] - var) < 1e-12 * var);
    size_t i_width = a.n_param + 6; /* green by beta_R */
    sum = 0.0;
    for (int k = 0; k < N_ROTATION; k++) sum += turned[k].jac[i_width] / N_ROTATION;
    assert_true(fabs(mean[0].jac[i_width] - sum) < 1e-12 * fmax(1.0, fabs(sum)));
    assert_int_equal(mean[0].n_path, N_ROTATION * 512);
    const size_t uneven[2] = {1000, 1}; /* rounded up to estimate_n_path */
    q.n_path = uneven;
    assert_int_equal(estimate_run(&q, pool, NULL, mean, NULL), STATUS_OK);
    for (size_t i = 0; i < 2; i++) assert_int_equal(mean[i].n_path, estimate_n_path(&wanted[i], uneven[i]));
    assert_int_equal(mean[0].n_path, N_ROTATION * 256);

    struct error err;
    wanted[0].contrast_cells = 4;
    assert_int_equal(estimate_run(&q, pool, NULL, mean, &err), STATUS_INVALID);
    scene_free(scene);
    thread_pool_free(pool);
    fiber_set_release(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_ids_are_unique_and_found),
        cmocka_unit_test(test_volume_models_end_with_the_density_multiplier),
        cmocka_unit_test(test_same_figures_as_the_tracers),
        cmocka_unit_test(test_mean_over_rotations),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
