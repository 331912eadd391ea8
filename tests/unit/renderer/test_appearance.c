/* The list of models that a fit can choose from, and the estimates behind it: the same figures as from the tracers
 * themselves. */
#include "renderer/scattering/appearance.h"
#include "renderer/transport/appearance_estimate.h"
#include "renderer/transport/volume_estimate.h"
#include "tests/support/cloth/hand_volume.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/tracer/orbit_configurations.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

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
        int d = appearance_param_index(&a, APPEARANCE_DENSITY_MULTIPLIER);
        if (a.kind == APPEARANCE_SURFACE) {
            assert_int_equal(d, -1);
            continue;
        }
        assert_int_equal(d, a.n_param - 1);
        assert_true(param_to_file_unit(&a.param[d], a.param[d].start) == 4000.0); /* per cm */
        assert_true(param_from_file_unit(&a.param[d], 4000.0) == 4e5);            /* per m */
    }
}

static void request_init(struct appearance_request *q, const struct appearance *a, double *param,
                         const struct configuration *c, const size_t *n_path)
{
    for (size_t p = 0; p < a->n_param; p++) param[p] = a->param[p].start;
    *q = (struct appearance_request){.model = a,
                                     .param = param,
                                     .configuration = c,
                                     .n_configuration = 2,
                                     .n_path = n_path,
                                     .seed = 3,
                                     .want_jacobian = true};
}

static void test_same_figures_as_the_tracers(void **unused)
{
    (void)unused;
    struct thread_pool *pool = NULL;
    struct fiber_set f;
    struct direction_volume v;
    struct scene *scene = NULL;
    struct volume_scene volume;
    struct configuration c[16];
    struct appearance a;
    struct appearance_request q;
    struct estimate here[2], there[2];
    double param[SCATTERING_MAX_PARAM];
    const size_t n_path[2] = {512, 256}, n[3] = {16, 16, 8};
    const struct scene_option option = {.black_sheet = true};
    const struct volume_scene_option volume_option = {.black_sheet = true};
    orbit_configurations_16(c);
    hand_weave_small(&f);
    hand_volume_weave(&v, n, 4e-6, 0.4);
    assert_int_equal(thread_pool_new(1, &pool, NULL), STATUS_OK);
    assert_int_equal(scene_new(&f, &option, &scene, NULL), STATUS_OK);
    assert_int_equal(volume_scene_init(&volume, &v, &volume_option, NULL), STATUS_OK);

    appearance_at(0, &a);
    request_init(&q, &a, param, c, n_path);
    q.scene.fibers = scene;
    const struct estimate_request surface = {.scene = scene,
                                             .model = a.surface,
                                             .param = param,
                                             .configuration = c,
                                             .n_configuration = 2,
                                             .n_path = n_path,
                                             .seed = 3,
                                             .want_jacobian = true};
    assert_int_equal(appearance_estimate_run(&q, pool, NULL, here, NULL), STATUS_OK);
    assert_int_equal(estimate_run(&surface, pool, NULL, there, NULL), STATUS_OK);
    assert_memory_equal(here, there, sizeof here);

    appearance_from_volume(phase_registry()[0], &a);
    request_init(&q, &a, param, c, n_path);
    struct error err;
    assert_int_equal(appearance_estimate_run(&q, pool, NULL, here, &err), STATUS_INVALID); /* no volume given */
    assert_non_null(strstr(err.text, a.id));
    q.scene.volume = &volume;
    const struct volume_estimate_request volumetric = {.scene = &volume,
                                                       .model = a.volume,
                                                       .param = param,
                                                       .multiplier_per_m = 4e5,
                                                       .configuration = c,
                                                       .n_configuration = 2,
                                                       .n_path = n_path,
                                                       .seed = 3,
                                                       .want_jacobian = true};
    assert_int_equal(appearance_estimate_run(&q, pool, NULL, here, NULL), STATUS_OK);
    assert_int_equal(volume_estimate_run(&volumetric, pool, NULL, there, NULL), STATUS_OK);
    assert_memory_equal(here, there, sizeof here);

    volume_scene_release(&volume);
    scene_free(scene);
    thread_pool_free(pool);
    fiber_set_release(&f);
    direction_volume_release(&v);
}

/* The mean over rotations against the cloth turned by hand, and a plain configuration beside it that stays as it is. */
static void test_mean_over_rotations(void **unused)
{
    (void)unused;
    enum { N_ROTATION = 5, N = N_ROTATION + 1 };
    struct thread_pool *pool = NULL;
    struct fiber_set f;
    struct scene *scene = NULL;
    struct configuration c[16], by_hand[N];
    struct appearance a;
    struct appearance_request q;
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
    q.scene.fibers = scene;
    q.n_configuration = N;
    assert_int_equal(appearance_estimate_run(&q, pool, NULL, turned, NULL), STATUS_OK);

    struct configuration wanted[2] = {c[1], c[0]};
    wanted[0].n_rotation = N_ROTATION;
    q.configuration = wanted;
    q.n_configuration = 2;
    q.n_path = n_path;
    assert_int_equal(appearance_estimate_run(&q, pool, NULL, mean, NULL), STATUS_OK);
    assert_memory_equal(&mean[1], &turned[N_ROTATION], sizeof mean[1]);
    double least = INFINITY, most = 0.0;
    for (int k = 0; k < N_ROTATION; k++) {
        least = fmin(least, turned[k].mean[1]);
        most = fmax(most, turned[k].mean[1]);
        sum += turned[k].mean[1] / N_ROTATION;
        var += turned[k].var[1] / (N_ROTATION * N_ROTATION);
    }
    assert_true(most - least > 0.05 * sum); /* not one of them for all */
    assert_true(fabs(mean[0].mean[1] - sum) < 1e-12 && fabs(mean[0].var[1] - var) < 1e-12 * var);
    size_t i_width = a.n_param + 6; /* green by beta_R */
    sum = 0.0;
    for (int k = 0; k < N_ROTATION; k++) sum += turned[k].jac[i_width] / N_ROTATION;
    assert_true(fabs(mean[0].jac[i_width] - sum) < 1e-12 * fmax(1.0, fabs(sum)));
    assert_int_equal(mean[0].n_path, N_ROTATION * 512);
    const size_t uneven[2] = {1000, 1}; /* rounded up: appearance_n_path foretells to what */
    q.n_path = uneven;
    assert_int_equal(appearance_estimate_run(&q, pool, NULL, mean, NULL), STATUS_OK);
    for (size_t i = 0; i < 2; i++) assert_int_equal(mean[i].n_path, appearance_n_path(&wanted[i], uneven[i]));
    assert_int_equal(mean[0].n_path, N_ROTATION * 256);

    struct error err;
    wanted[0].contrast_cells = 4;
    assert_int_equal(appearance_estimate_run(&q, pool, NULL, mean, &err), STATUS_INVALID);
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
