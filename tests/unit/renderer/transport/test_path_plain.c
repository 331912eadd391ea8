/* Walks of plain settings: the same bits as by the walk that knows all; which settings are plain. */
#include "renderer/transport/camera.h"
#include "renderer/transport/surface/path_tracer.h"
#include "tests/support/cloth/hand_weave.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

static const struct configuration configuration = {.light_theta_rad = 0.6,
                                                   .light_phi_rad = 3,
                                                   .camera_theta_rad = 0.4,
                                                   .light_distance_m = 0.61,
                                                   .lamp_side_m = 0.1,
                                                   .camera_distance_m = 1,
                                                   .crop_m = 0.004};

/* The setting of a model at its start, in a small weave. */
struct fixture {
    struct scene *scene;
    const struct scattering_model *model;
    struct scattering_state *state;
    struct path_setting setting;
};

static void make(struct fixture *x, const char *model)
{
    struct fiber_set f;
    double param[SCATTERING_MAX_PARAM];
    x->model = scattering_find(model);
    for (size_t p = 0; p < x->model->n_param; p++) param[p] = x->model->param[p].start;
    hand_weave_small(&f);
    assert_int_equal(scene_new(&f, &(struct scene_option){.black_sheet = true}, &x->scene, NULL), STATUS_OK);
    fiber_set_release(&f);
    assert_int_equal(x->model->prepare(param, &x->state, NULL), STATUS_OK);
    path_setting_init(&x->setting, x->scene, x->model, x->state, &configuration, true);
}

static void release(struct fixture *x)
{
    x->model->release(x->state);
    scene_free(x->scene);
}

static void gives_the_same_bits(void **state)
{
    (void)state;
    struct fixture x;
    struct camera camera;
    uint32_t n_bounce = 0;
    make(&x, "two_lobe.v1");
    camera_init(&camera, &configuration);
    struct path_setting plain = x.setting;
    path_setting_choose(&plain);
    assert_true(plain.plain && !x.setting.plain);
    for (uint32_t i = 0; i < 500; i++) {
        struct rng r[2];
        struct scene_ray ray[2];
        struct path_result out[2];
        double xy[2];
        rng_start(&r[0], &(struct rng_key){.seed = 1}, i, 0);
        for (int a = 0; a < 2; a++) xy[a] = rng_double(&r[0]);
        if (!camera_ray(&camera, x.scene, xy, &ray[0])) continue;
        ray[1] = ray[0];
        r[1] = r[0];
        path_trace(&x.setting, &ray[0], &r[0], &out[0], NULL);
        path_trace(&plain, &ray[1], &r[1], &out[1], NULL);
        assert_memory_equal(out[0].radiance, out[1].radiance, sizeof out[0].radiance);
        assert_memory_equal(out[0].jac, out[1].jac, 3 * x.model->n_param * sizeof *out[0].jac);
        assert_int_equal(out[0].n_bounce, out[1].n_bounce);
        assert_int_equal(rng_u32(&r[0]), rng_u32(&r[1]));
        n_bounce += out[0].n_bounce;
    }
    assert_true(n_bounce > 1000);
    release(&x);
}

static bool is_plain(struct path_setting s)
{
    path_setting_choose(&s);
    return s.plain;
}

static void add_nothing(const void *context, const struct scene_hit *hit, const struct scene_ray *ray, struct rng *rng,
                        float rgb[3])
{
    (void)context, (void)hit, (void)ray, (void)rng, (void)rgb;
}

static void rare_parts_are_not_plain(void **state)
{
    (void)state;
    static const char *const other_model[] = {"chiang.v1", "elliptical.v1", "dielectric_near.v1"};
    struct fixture x;
    struct path_setting s;
    make(&x, "two_lobe.v1");
    assert_true(is_plain(x.setting));
    s = x.setting, s.n_set = 2;
    assert_false(is_plain(s));
    s = x.setting, s.shows_width = true;
    assert_false(is_plain(s));
    s = x.setting, s.n_traced = 1;
    assert_false(is_plain(s));
    s = x.setting, s.begin = add_nothing;
    assert_false(is_plain(s));
    s = x.setting, s.discrepancy = (const void *)&x;
    assert_false(is_plain(s));
    s = x.setting, s.speckle.table = (const void *)&x;
    assert_false(is_plain(s));
    s = x.setting, s.lights.image = (const void *)&x;
    assert_false(is_plain(s));
    release(&x);
    for (size_t i = 0; i < sizeof other_model / sizeof *other_model; i++) {
        make(&x, other_model[i]);
        assert_false(is_plain(x.setting));
        release(&x);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(gives_the_same_bits),
                                       cmocka_unit_test(rare_parts_are_not_plain)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
