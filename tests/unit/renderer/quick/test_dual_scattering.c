/* Dual scattering: the count of fibers in front against rays from fiber to fiber, its limits, and what of the light in
 * a furnace it loses. */
#include "base/rng.h"
#include "renderer/estimate/estimate.h"
#include "renderer/estimate/radiance_source.h"
#include "renderer/mesh/mesh_shapes.h"
#include "renderer/quick/dual_shade.h"
#include "tests/support/cloth/dual_cloth.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/tracer/orbit_configurations.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* ---- fibers in front ---- */

/* Through n straight fibers across the light: a_f to the n-th, and n times the variance. */
static void layers_in_front(void **state)
{
    (void)state;
    static const double y_z[5][2] = {{1e-4, 0}, {1e-4, -6e-5}, {1e-4, -1.2e-4}, {1e-4, -1.8e-4}, {1e-4, -2.4e-4}};
    struct fiber_set f;
    struct dual_cloth c;
    hand_straight(&f, 5, y_z, 2e-4, 2e-5);
    dual_cloth_init(&c, &f, 0, dual_cloth_narrow);
    struct dual_option option = {&c.tables, 1, 1};
    struct dual_setting setting = {.option = &option, .path = {.scene = c.scene, .model = c.model, .n_set = 1}};
    struct scene_ray ray = {.origin_mm = {0.05f, 0.1f, -0.35f}, .direction = {0, 0, 1}};
    struct dual_hit h = {.i_set = 0};
    struct dual_average a;
    struct rng rng;
    rng_start(&rng, &(struct rng_key){.seed = 1}, 0, 0);
    dual_average_at(&c.tables, 0, 0, &a);
    for (int n = 4; n >= 0; n--) {
        struct dual_front front;
        static const float up[3] = {0, 0, 1};
        assert_true(scene_trace(c.scene, &ray, &h.hit));
        memcpy(h.offset_mm, ray.offset_mm, sizeof h.offset_mm);
        assert_true(dual_front_of(&setting, &h, up, &rng, &front));
        assert_int_equal(front.n_fiber, n);
        for (int k = 0; k < 3; k++)
            assert_true(fabs((double)front.transmitted[k] / pow((double)a.forward[k], n) - 1) < 1e-5);
        assert_true(fabsf(front.var_rad2 - (float)n * a.var_forward_rad2) < 1e-6f);
        scene_ray_leave(&h.hit, h.offset_mm, up, &ray);
    }
    dual_cloth_release(&c);
}

static bool count_one(void *context, uint32_t i_segment, float sin_theta)
{
    (void)i_segment;
    assert_true(fabsf(sin_theta) <= 1.0001f);
    ++*(size_t *)context;
    return true;
}

/* One traversal finds all fibers that rays from fiber to fiber do, and those whose front faces lie within another
 * fiber: a ray from fiber to fiber starts behind the far side of each. The strands of this weave overlap. */
static void visits_of(const struct scene *scene, double *by_visit, double *by_steps)
{
    struct rng rng;
    rng_start(&rng, &(struct rng_key){.seed = 4}, 0, 0);
    *by_visit = *by_steps = 0;
    for (int i = 0; i < 4000; i++) {
        double z = 0.3 + 0.7 * rng_double(&rng), phi = 2 * M_PI * rng_double(&rng), s = sqrt(1 - z * z);
        const double from[3] = {0.3 * rng_double(&rng) - 0.15 + s * cos(phi),
                                0.3 * rng_double(&rng) - 0.15 + s * sin(phi), z},
                     to[3] = {-s * cos(phi), -s * sin(phi), -z};
        struct scene_ray ray;
        struct scene_hit hit;
        size_t n = 0;
        if (!scene_ray_enter(scene, from, to, &ray)) continue;
        scene_visit_ahead(scene, &ray, count_one, &n);
        *by_visit += (double)n;
        for (int k = 0; k < 200 && scene_trace(scene, &ray, &hit); k++, *by_steps += 1) {
            float on[3];
            double offset[2];
            memcpy(on, ray.direction, sizeof on);
            memcpy(offset, ray.offset_mm, sizeof offset);
            scene_ray_leave(&hit, offset, on, &ray);
        }
    }
}

static void visits_in_flat_and_bent_cloth(void **state)
{
    (void)state;
    struct dual_cloth c;
    struct mesh m;
    struct scene *bent;
    struct error err = {0};
    double visits, steps;
    dual_cloth_weave(&c, 0.5, NULL);
    visits_of(c.scene, &visits, &steps);
    print_message("fibers of 4000 rays: %g by visits, %g step by step\n", visits, steps);
    assert_true(steps > 8000 && visits >= steps && visits < 1.15 * steps);
    assert_int_equal(mesh_cylinder(2, 2, 1, 60, &m, &err), STATUS_OK);
    assert_int_equal(scene_bend(c.scene, &m, false, &bent, &err), STATUS_OK);
    mesh_release(&m);
    visits_of(bent, &visits, &steps);
    print_message("bent: %g by visits, %g step by step\n", visits, steps);
    assert_true(steps > 8000 && visits >= steps && visits < 1.15 * steps);
    scene_free(bent);
    dual_cloth_release(&c);
}

/* ---- pictures ---- */

static void estimate_of(const struct dual_cloth *c, const struct configuration *view, float density, struct estimate *e)
{
    struct appearance model;
    struct error err = {0};
    size_t n_path = 16384;
    struct dual_option dual = {&c->tables, density, density};
    struct estimate_request q = {.input = trace_input_surface(c->scene, c->model, c->param, &model),
                                 .configuration = view,
                                 .n_configuration = 1,
                                 .n_path = &n_path,
                                 .seed = 11,
                                 .replica = density > 0};
    q.input.dual = density > 0 ? &dual : NULL;
    if (estimate_run(&q, NULL, NULL, e, &err) != STATUS_OK) fail_msg("%s", err.text);
}

/* The white furnace: a lossless cloth under a sky of radiance 1 has that radiance. Dual scattering keeps a part of it:
 * it follows light along straight lines only. */
static void furnace(void **state)
{
    (void)state;
    struct dual_cloth c;
    struct configuration view[16];
    dual_cloth_weave(&c, 1, NULL);
    orbit_configurations_16(view);
    for (int i = 0; i < 16; i += 5) {
        struct estimate path, hair, full;
        view[i].light = LIGHT_NO_LAMP;
        for (int k = 0; k < 3; k++) view[i].environment_rgb[k] = 1;
        estimate_of(&c, &view[i], 0, &path);
        estimate_of(&c, &view[i], 0.7f, &hair);
        estimate_of(&c, &view[i], 1, &full);
        print_message("furnace: paths %.3f, dual %.3f with densities of 0.7, %.3f with 1\n", path.mean[0], hair.mean[0],
                      full.mean[0]);
        assert_true(fabs(path.mean[0] - 1) < 0.02);
        assert_true(full.mean[0] < 1 && full.mean[0] > 0.5 && hair.mean[0] < full.mean[0]);
    }
    dual_cloth_release(&c);
}

/* Dark fibers scatter light once: dual scattering is then what path tracing finds, but for a fraction of the albedo. */
static void dark_fibers_scatter_once(void **state)
{
    (void)state;
    struct dual_cloth c;
    struct configuration view[16];
    dual_cloth_weave(&c, 0.01, NULL);
    orbit_configurations_16(view);
    for (int i = 0; i < 16; i += 3) {
        struct estimate path, dual;
        estimate_of(&c, &view[i], 0, &path);
        estimate_of(&c, &view[i], 1, &dual);
        double noise = sqrt(path.var[1] + dual.var[1]);
        assert_true(fabs(dual.mean[1] - path.mean[1]) < 0.01 * path.mean[1] + 4 * noise && noise < 0.03 * path.mean[1]);
    }
    dual_cloth_release(&c);
}

/* Colored fibers with wide lobes under a lamp: darker than path tracing, as published, and of nearly its color. */
static void means_under_a_lamp(void **state)
{
    (void)state;
    struct dual_cloth c;
    struct configuration view[16];
    double sum[2][3] = {{0}}, square = 0, n = 0;
    dual_cloth_weave(&c, 0, dual_cloth_wide);
    orbit_configurations_16(view);
    for (int i = 0; i < 16; i++) {
        struct estimate path, dual;
        estimate_of(&c, &view[i], 0, &path);
        estimate_of(&c, &view[i], 1, &dual);
        for (int k = 0; k < 3; k++, n += 1) {
            sum[0][k] += path.mean[k];
            sum[1][k] += dual.mean[k];
            square += pow(dual.mean[k] - path.mean[k], 2) - path.var[k] - dual.var[k];
        }
    }
    double all = (sum[0][0] + sum[0][1] + sum[0][2]) / n, red = sum[1][0] / sum[0][0], blue = sum[1][2] / sum[0][2];
    print_message("under a lamp: red %.3f, green %.3f, blue %.3f of path tracing; rms of means %.3f\n", red,
                  sum[1][1] / sum[0][1], blue, sqrt(fmax(0, square / n)) / all);
    assert_true(red > 0.6 && red < 1.05 && blue > 0.75 && blue < 1.05);
    dual_cloth_release(&c);
}

static void what_is_refused(void **state)
{
    (void)state;
    struct dual_cloth c;
    struct appearance model;
    struct configuration view[16];
    struct radiance_source source;
    struct dual_tables none;
    struct error err = {0};
    dual_cloth_weave(&c, 0.5, NULL);
    orbit_configurations_16(view);
    struct dual_option dual = {&c.tables, 1.5f, 1};
    struct radiance_input in = trace_input_surface(c.scene, c.model, c.param, &model);
    in.dual = &dual;
    assert_int_equal(radiance_source_init(&source, &in, view, 1, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "1.5"));
    dual.density_forward = 1;
    in.want_derivative = true;
    assert_int_equal(radiance_source_init(&source, &in, view, 1, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "derivatives"));
    in.want_derivative = false;
    in.discrepancy = &(const struct discrepancy){.n = 0};
    assert_int_equal(radiance_source_init(&source, &in, view, 1, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "discrepancy"));
    for (const struct scattering_model *const *m = scattering_registry(); *m != NULL; m++) {
        double start[SCATTERING_MAX_PARAM];
        for (size_t p = 0; p < (*m)->n_param; p++) start[p] = (*m)->param[p].start;
        status s = dual_tables_init(&none, c.scene, *m, start, 0, NULL, NULL, &err);
        assert_int_equal(s, scattering_frame_reason(*m) != NULL ? STATUS_INVALID : STATUS_OK);
        for (size_t i = 0; i < DUAL_N_THETA && s == STATUS_OK; i++)
            for (int k = 0; k < 3; k++) {
                const struct dual_average *a = &none.average[i];
                assert_true(a->forward[k] >= 0 && a->backward[k] >= 0 && a->forward[k] + a->backward[k] < 1.05f);
                assert_true(a->deep[k] >= 0 && isfinite(a->deep[k]) && isfinite(a->var_deep_rad2));
            }
        dual_tables_release(&none);
    }
    dual_cloth_release(&c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(layers_in_front),
        cmocka_unit_test(visits_in_flat_and_bent_cloth),
        cmocka_unit_test(furnace),
        cmocka_unit_test(dark_fibers_scatter_once),
        cmocka_unit_test(means_under_a_lamp),
        cmocka_unit_test(what_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
