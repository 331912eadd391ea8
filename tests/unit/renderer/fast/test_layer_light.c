/* Light from other parts of a bent cloth, and at its cut edge: the share of a pile against closed forms, the border of
 * a bent cloth, and a furnace of a roll that is seen from its end, where tables of a flat cloth alone are dark. */
#include "renderer/estimate/estimate.h"
#include "renderer/fast/deep_light.h"
#include "renderer/fast/fast_tables.h"
#include "renderer/fast/precompute/fast_precompute.h"
#include "renderer/mesh/mesh_curves.h"
#include "renderer/mesh/mesh_shapes.h"
#include "renderer/scene/scene_place.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { EDGE = 6 };

static struct scene *flat_cloth(void)
{
    struct fiber_set f;
    struct scene *s;
    struct error err = {0};
    hand_weave_small(&f);
    if (scene_new(&f, &(struct scene_option){0}, &s, &err) != STATUS_OK) fail_msg("%s", err.text);
    fiber_set_release(&f);
    return s;
}

/* A pile of cloths that let nothing through is as bright as one of them; one that loses nothing sends all light back;
 * the share does not change when a cloth is laid upon it: p = R + T^2 p / (1 - R p). */
static void pile(void **state)
{
    (void)state;
    const struct deep_light d = {.back = {0.5f, 0.5f, 0.5f}, .through = {0.25f, 0, 0.5f}};
    const double p = (double)deep_light_pile(&d, 0);
    assert_true(fabs(p - (0.5 + 0.0625 * p / (1 - 0.5 * p))) < 1e-6);
    assert_true(fabsf(deep_light_pile(&d, 1) - 0.5f) < 1e-6f);
    assert_true(fabsf(deep_light_pile(&d, 2) - 1) < 1e-3f);
}

/* Of a flat sheet, the border is seen from the side and not from above or from below. */
static void border(void **state)
{
    (void)state;
    struct scene *flat = flat_cloth(), *sheet;
    struct mesh m;
    struct error err = {0};
    int n_side = 0, n_above = 0;
    assert_int_equal(mesh_flat((const double[2]){2.0, 2.0}, (const size_t[2]){4, 4}, &m, NULL), STATUS_OK);
    if (scene_bend(flat, &m, false, &sheet, &err) != STATUS_OK) fail_msg("%s", err.text);
    for (int i = 0; i < 60; i++) {
        const double along = -0.9 + 0.03 * i, middle_mm = -0.5 * scene_thickness_mm(flat);
        const double from[2][3] = {{-5.0, along, middle_mm + 0.3}, {along, 0.1, 5.0}};
        const double towards[2][3] = {{cos(0.05), 0.0, -sin(0.05)}, {0.05, 0.0, -sqrt(1.0 - 0.0025)}};
        for (int k = 0; k < 2; k++) {
            struct scene_ray ray;
            struct scene_hit hit;
            float point[3], normal[3];
            if (!scene_ray_enter(sheet, from[k], towards[k], &ray) || !scene_trace(sheet, &ray, &hit)) continue;
            const float back[3] = {-ray.direction[0], -ray.direction[1], -ray.direction[2]};
            const bool seen = scene_border_seen(sheet, &hit, back, point, normal);
            if (k == 1) {
                assert_false(seen);
                n_above++;
            } else if (seen) {
                assert_true(fabsf(normal[0] + 1) < 1e-5f && fabsf(point[0] + 1.0f) < 0.03f);
                n_side++;
            }
        }
    }
    assert_true(n_side > 20 && n_above > 20);
    mesh_release(&m);
    scene_free(sheet);
    scene_free(flat);
}

static double mean_of(struct scene *roll, const struct fast_tables *t, const struct scattering_model *model,
                      const double *param, const struct configuration *c)
{
    const struct fast_option fast = {.tables = t, .n_traced = 1, .deep = true};
    const size_t n_path = 8192;
    struct appearance shown;
    struct estimate e;
    struct error err = {0};
    struct estimate_request r = {.input = trace_input_surface(roll, model, param, &shown),
                                 .configuration = c,
                                 .n_configuration = 1,
                                 .n_path = &n_path,
                                 .seed = 11};
    r.input.fast = &fast;
    if (estimate_run(&r, NULL, NULL, &e, &err) != STATUS_OK) fail_msg("%s", err.text);
    return e.mean[0];
}

/* A lossless cloth in a roll under a sky of radiance 1 has the radiance 1 everywhere. */
static void furnace_of_a_roll(void **state)
{
    (void)state;
    struct scene *flat = flat_cloth(), *roll;
    struct mesh m;
    struct error err = {0};
    struct fast_tables t;
    const struct scattering_model *model = scattering_find("isotropic.v1");
    double param[SCATTERING_MAX_PARAM];
    for (size_t p = 0; p < model->n_param; p++) param[p] = 1.0;
    const struct fast_precompute_request q = {.scene = flat,
                                              .model = model,
                                              .param = param,
                                              .n_path = 10,
                                              .cell_paths = 20,
                                              .no_visibility = true,
                                              .deep_traced = 1,
                                              .deep_edge = EDGE,
                                              .deep_paths = 200000};
    if (fast_precompute(&q, NULL, NULL, &t, &err) != STATUS_OK) fail_msg("%s", err.text);
    for (int c = 0; c < 3; c++) assert_true(fabsf(t.deep.back[c] + t.deep.through[c] - 1) < 1e-4f);
    const double thick_mm = scene_thickness_mm(flat);
    const struct mesh_roll shape = {.radius_mm = 8 * thick_mm,
                                    .core_mm = 3 * thick_mm,
                                    .pitch_mm = 1.06 * thick_mm,
                                    .tail_mm = 4 * thick_mm,
                                    .length_mm = 10 * thick_mm};
    if (mesh_roll_make(&shape, &m, &err) != STATUS_OK || scene_bend(flat, &m, false, &roll, &err) != STATUS_OK)
        fail_msg("%s", err.text);
    struct fast_tables alone = t; /* of a flat cloth that sends and lets no light to itself */
    memset(alone.deep.back, 0, sizeof alone.deep.back);
    memset(alone.deep.through, 0, sizeof alone.deep.through);
    for (int k = 0; k < 2; k++) {
        const struct configuration c = {.light = LIGHT_NO_LAMP,
                                        .environment_rgb = {1, 1, 1},
                                        .camera_theta_rad = k == 0 ? 1.2 : 0.3,
                                        .camera_phi_rad = -M_PI_2,
                                        .camera_distance_m = 1.0,
                                        .crop_m = 16e-3 * thick_mm};
        const double with = mean_of(roll, &t, model, param, &c), without = mean_of(roll, &alone, model, param, &c);
        print_message("%.4f, by tables of a flat cloth alone %.4f\n", with, without);
        assert_true(without < 0.85 && with > 0.9 && with < 1.02);
    }
    fast_tables_release(&t);
    mesh_release(&m);
    scene_free(roll);
    scene_free(flat);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(pile), cmocka_unit_test(border),
                                       cmocka_unit_test(furnace_of_a_roll)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
