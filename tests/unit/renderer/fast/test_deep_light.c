/* The table of light that is scattered more often than the paths of a fast picture are traced: a furnace, means of a
 * cloth with narrow lobes against path tracing, which the cells' harmonics miss, any number of threads, and directions
 * in a sheared cloth, and where deep light enters a bent one. */
#include "renderer/estimate/estimate.h"
#include "renderer/fast/deep_shade.h"
#include "renderer/fast/fast_setting.h"
#include "renderer/fast/fast_tables.h"
#include "renderer/fast/precompute/fast_precompute.h"
#include "renderer/mesh/mesh_shapes.h"
#include "renderer/scene/scene_place.h"
#include "renderer/transport/lights.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/tracer/orbit_configurations.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { TRACED = 2, FURNACE_PATHS = 200000 };

static struct cloth {
    struct scene *scene;
    const struct scattering_model *model;
    double param[SCATTERING_MAX_PARAM];
    struct fast_tables tables;
} white, narrow;

/* param in file units; NULL: a lossless cloth without a black sheet. */
static void make_cloth(struct cloth *c, const double *param)
{
    struct fiber_set f;
    struct error err = {0};
    hand_weave_small(&f);
    if (scene_new(&f, &(struct scene_option){.black_sheet = param != NULL}, &c->scene, &err) != STATUS_OK)
        fail_msg("%s", err.text);
    fiber_set_release(&f);
    c->model = scattering_find(param != NULL ? "two_lobe.v1" : "isotropic.v1");
    for (size_t p = 0; p < c->model->n_param; p++)
        c->param[p] = param != NULL ? param_from_file_unit(&c->model->param[p], param[p]) : 1.0;
    const struct fast_precompute_request q = {.scene = c->scene,
                                              .model = c->model,
                                              .param = c->param,
                                              .n_path = param != NULL ? 500 : 10,
                                              .cell_paths = param != NULL ? 3 : 20,
                                              .no_visibility = true,
                                              .deep_traced = TRACED,
                                              .deep_edge = param != NULL ? 10 : 6,
                                              .deep_paths = param != NULL ? 500000 : FURNACE_PATHS};
    if (fast_precompute(&q, NULL, NULL, &c->tables, &err) != STATUS_OK) fail_msg("%s", err.text);
}

static int set_up(void **state)
{
    static const double gabardine[] = {0.185, 0.047, 0.069, 0.999, 0.330, 0.354, 2.141, 10, 23.548};
    (void)state;
    make_cloth(&white, NULL);
    make_cloth(&narrow, gabardine);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    fast_tables_release(&white.tables);
    fast_tables_release(&narrow.tables);
    scene_free(white.scene);
    scene_free(narrow.scene);
    return 0;
}

static void estimate_of(const struct cloth *c, const struct configuration *view, const struct fast_option *fast,
                        size_t n_path, struct estimate *e)
{
    struct error err = {0};
    struct appearance model;
    struct estimate_request r = {.input = trace_input_surface(c->scene, c->model, c->param, &model),
                                 .configuration = view,
                                 .n_configuration = 1,
                                 .n_path = &n_path,
                                 .seed = 11,
                                 .replica = fast != NULL ? 1 + fast->deep : 0};
    r.input.fast = fast;
    if (estimate_run(&r, NULL, NULL, e, &err) != STATUS_OK) fail_msg("%s", err.text);
}

/* In a lossless cloth under a sky of radiance 1 every picture has the radiance 1, of which the hits that are traced
 * have some and the table the rest. A node of views has its share of the table's paths, of which a part between 0 and 1
 * is deep, so that its standard error is at most 0.5 over their root; 32 of 6 x 6 nodes touch the disk, on two sides.
 * The steps of the residual raise the noise of the first value by less than (1 + N_STEP) times. */
static void furnace(void **state)
{
    (void)state;
    struct configuration c[16];
    const struct fast_option fast = {.tables = &white.tables, .n_traced = TRACED, .deep = true};
    const double table_var = 0.25 / (FURNACE_PATHS / 64.0);
    double sum = 0;
    orbit_configurations_16(c);
    for (int i = 0; i < 16; i += 5) {
        struct estimate e;
        c[i].light = LIGHT_NO_LAMP;
        for (int k = 0; k < 3; k++) c[i].environment_rgb[k] = 1;
        estimate_of(&white, &c[i], &fast, 4096, &e);
        print_message("%.4f +- %.4f\n", e.mean[0], sqrt(e.var[0]));
        assert_true(fabs(e.mean[0] - 1) < 4 * sqrt(e.var[0] + 9 * table_var));
        sum += e.mean[0] / 4;
    }
    assert_true(fabs(sum - 1) < 4 * sqrt(table_var));
}

/* Means under a lamp against path tracing; harmonics of the cells beside them. */
static void means(void **state)
{
    (void)state;
    struct configuration c[16];
    orbit_configurations_16(c);
    const struct fast_option deep = {.tables = &narrow.tables, .n_traced = TRACED, .deep = true},
                             cells = {.tables = &narrow.tables, .n_traced = TRACED};
    double error2[2] = {0}, noise2[2] = {0}, mean = 0;
    for (int i = 0; i < 16; i++) {
        struct estimate path, fast[2];
        estimate_of(&narrow, &c[i], NULL, 4096, &path);
        estimate_of(&narrow, &c[i], &cells, 1024, &fast[0]);
        estimate_of(&narrow, &c[i], &deep, 1024, &fast[1]);
        for (int k = 0; k < 3; k++) {
            mean += path.mean[k] / 48;
            for (int m = 0; m < 2; m++) {
                double d = fast[m].mean[k] - path.mean[k];
                error2[m] += d * d / 48;
                noise2[m] += (path.var[k] + fast[m].var[k]) / 48;
            }
        }
    }
    for (int m = 0; m < 2; m++)
        print_message("%s: %.2f %% rms with the noise of %.2f %%\n", m == 0 ? "cells" : "directions",
                      100 * sqrt(error2[m]) / mean, 100 * sqrt(noise2[m]) / mean);
    print_message("noise of the table: %.2f %%\n", 100 * (double)narrow.tables.deep.error);
    assert_true(error2[1] < 0.5 * error2[0]);
}

/* What is shaded has the class of the fiber that is hit: with tables of 0 and of 1, one class alone has deep light. */
static void a_hit_has_the_table_of_its_fiber(void **state)
{
    (void)state;
    const struct configuration c = {.light = LIGHT_DIRECTIONAL, .camera_distance_m = 1.0, .crop_m = 0.01};
    struct fast_tables marked = narrow.tables;
    const struct fast_option option = {.tables = &marked, .n_traced = TRACED, .deep = true};
    struct fast_setting fast = {.option = &option};
    size_t n_value = deep_light_n_value(&marked.deep), n[2] = {0, 0};
    marked.deep.value = calloc(n_value, sizeof *marked.deep.value);
    assert_non_null(marked.deep.value);
    for (size_t i = n_value / 2; i < n_value; i++) marked.deep.value[i] = 1;
    fast.path.scene = narrow.scene;
    lights_init(&fast.path.lights, &c);
    for (uint32_t i = 0; i < 200; i++) {
        struct rng rng;
        struct scene_ray ray;
        struct scene_hit hit;
        float rgb[3] = {0, 0, 0};
        rng_start(&rng, &(struct rng_key){3, 0, 0, 0}, i, 0);
        const double from[3] = {0.5 * rng_double(&rng), 0.5 * rng_double(&rng), 1}, down[3] = {0, 0, -1};
        if (!scene_ray_enter(narrow.scene, from, down, &ray) || !scene_trace(narrow.scene, &ray, &hit)) continue;
        size_t k = deep_light_class(hit.tangent);
        deep_shade_begin(&fast, &hit, &ray, &rng, rgb);
        assert_true(fabsf(rgb[0] - (float)k) < 1e-4f); /* light from above has the cosine 1, and the irradiance pi */
        n[k]++;
    }
    assert_true(n[0] > 20 && n[1] > 20);
    free(marked.deep.value);
}

/* The same table for any number of threads. */
static void threads(void **state)
{
    (void)state;
    struct thread_pool *pool = NULL;
    struct fast_tables a, b;
    const struct fast_precompute_request q = {.scene = narrow.scene,
                                              .model = narrow.model,
                                              .param = narrow.param,
                                              .n_path = 1,
                                              .cell_paths = 20,
                                              .no_visibility = true,
                                              .deep_traced = 1,
                                              .deep_edge = 4,
                                              .deep_paths = 5000};
    assert_int_equal(thread_pool_new(3, &pool, NULL), STATUS_OK);
    assert_int_equal(fast_precompute(&q, NULL, NULL, &a, NULL), STATUS_OK);
    assert_int_equal(fast_precompute(&q, pool, NULL, &b, NULL), STATUS_OK);
    assert_true(a.deep.error > 0 && a.deep.error == b.deep.error);
    assert_memory_equal(a.deep.value, b.deep.value, deep_light_n_value(&a.deep) * sizeof *a.deep.value);
    fast_tables_release(&a);
    fast_tables_release(&b);
    thread_pool_free(pool);
}

static void refuse(const struct fast_option *o, const char *why)
{
    struct estimate e;
    struct appearance model;
    struct configuration c[16];
    struct error err = {0};
    size_t n_path = 256;
    orbit_configurations_16(c);
    struct estimate_request r = {.input = trace_input_surface(narrow.scene, narrow.model, narrow.param, &model),
                                 .configuration = c,
                                 .n_configuration = 1,
                                 .n_path = &n_path};
    r.input.fast = o;
    assert_int_equal(estimate_run(&r, NULL, NULL, &e, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, why));
}

static void refusals(void **state)
{
    (void)state;
    refuse(&(struct fast_option){.tables = &narrow.tables, .n_traced = 1, .deep = true}, "1 hits");
    refuse(&(struct fast_option){.tables = &narrow.tables, .n_traced = 2, .deep = true, .visibility = FAST_TABLES},
           "visibility by tables");
    struct fast_tables t;
    struct error err = {0};
    const struct fast_precompute_request q = {
        .scene = narrow.scene, .model = narrow.model, .param = narrow.param, .deep_traced = 1, .deep_edge = 1};
    assert_int_equal(fast_precompute(&q, NULL, NULL, &t, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "1 node"));
}

/* Into a flat cloth that is turned and sheared: the rotation keeps the normal and the lines between weft and warp, and
 * is the map itself where nothing is sheared. */
static void rotation_of_a_sheared_place(void **state)
{
    (void)state;
    const float c = cosf(0.4f), s = sinf(0.4f), shear = 0.2f;
    const float turn[3][3] = {{c, 0, s}, {0, 1, 0}, {-s, 0, c}};
    for (int sheared = 0; sheared < 2; sheared++) {
        struct scene_place p = {0};
        float row[3][3];
        for (int a = 0; a < 3; a++) {
            p.to_cloth[0][a] = turn[0][a] + (sheared ? shear * turn[1][a] : 0);
            p.to_cloth[1][a] = turn[1][a] + (sheared ? shear * turn[0][a] : 0);
            p.to_cloth[2][a] = 1.5f * turn[2][a];
        }
        scene_place_rotation(&p, row);
        for (int k = 0; k < 3; k++)
            for (int a = 0; a < 3; a++) assert_true(fabsf(row[k][a] - turn[k][a]) < 1e-6f);
    }
}

/* Seen from above, light enters the cloth towards the lamp; under a lamp above, away from the camera. */
static void ways_lead_to_the_lamp(void **state)
{
    (void)state;
    static const float up[3] = {0, 0, 1};
    for (int i = 0; i < 8; i++) {
        const float azimuth[2] = {cosf((float)M_PI_4 * (float)i), sinf((float)M_PI_4 * (float)i)};
        const float low[3] = {0.9f * azimuth[0], 0.9f * azimuth[1], sqrtf(0.19f)};
        float lit[2], seen[2];
        deep_light_shift(&narrow.tables.deep, up, low, lit);
        deep_light_shift(&narrow.tables.deep, low, up, seen);
        assert_true(lit[0] * azimuth[0] + lit[1] * azimuth[1] > 0);
        assert_true(seen[0] * azimuth[0] + seen[1] * azimuth[1] < 0);
    }
    assert_true(narrow.tables.deep.spread_mm > 0);
}

/* Radiance of a small cylinder on which a low lamp shines across, seen from above, over that of the flat cloth. */
static double bent_over_flat(const struct scene *bent, const struct fast_option *fast, double *var)
{
    const struct configuration c = {
        .light = LIGHT_DIRECTIONAL, .light_theta_rad = 1.3, .camera_distance_m = 1.0, .crop_m = 0.5e-3};
    const size_t n_path = fast != NULL ? 8192 : 65536;
    struct estimate flat, seen;
    struct cloth on_cylinder = narrow;
    on_cylinder.scene = (struct scene *)(uintptr_t)bent;
    estimate_of(&narrow, &c, fast, n_path, &flat);
    estimate_of(&on_cylinder, &c, fast, n_path, &seen);
    double ratio = seen.mean[0] / flat.mean[0];
    *var = ratio * ratio * (seen.var[0] / (seen.mean[0] * seen.mean[0]) + flat.var[0] / (flat.mean[0] * flat.mean[0]));
    return ratio;
}

/* Low light enters a convex cloth where it falls more steeply than where it is seen. Tables without the ways miss that
 * by more than the noise, and with them by less than half as much. */
static void a_bent_cloth_is_lit_beside_the_hit(void **state)
{
    (void)state;
    struct mesh m;
    struct scene *bent;
    struct error err = {0};
    struct fast_tables no_ways = narrow.tables;
    const struct fast_option fast[2] = {{.tables = &no_ways, .n_traced = TRACED, .deep = true},
                                        {.tables = &narrow.tables, .n_traced = TRACED, .deep = true}};
    double var[3], path, off[2];
    no_ways.deep.spread_mm = 0;
    no_ways.deep.shift = calloc(deep_light_n_shift(&no_ways.deep), sizeof *no_ways.deep.shift);
    assert_non_null(no_ways.deep.shift);
    assert_int_equal(mesh_cylinder(1.2, 6, 1.4, 200, &m, NULL), STATUS_OK);
    if (scene_bend(narrow.scene, &m, true, &bent, &err) != STATUS_OK) fail_msg("%s", err.text);
    path = bent_over_flat(bent, NULL, &var[2]);
    for (int k = 0; k < 2; k++) off[k] = bent_over_flat(bent, &fast[k], &var[k]) - path;
    print_message("bent over flat %.4f +- %.4f; without ways %+.4f, with them %+.4f +- %.4f\n", path, sqrt(var[2]),
                  off[0], off[1], sqrt(var[1]));
    assert_true(fabs(off[0]) > 4 * sqrt(var[0] + var[2]));
    assert_true(fabs(off[1]) < 0.5 * fabs(off[0]));
    free(no_ways.deep.shift);
    mesh_release(&m);
    scene_free(bent);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(furnace),
                                       cmocka_unit_test(means),

                                       cmocka_unit_test(a_hit_has_the_table_of_its_fiber),
                                       cmocka_unit_test(threads),
                                       cmocka_unit_test(refusals),
                                       cmocka_unit_test(rotation_of_a_sheared_place),
                                       cmocka_unit_test(ways_lead_to_the_lamp),
                                       cmocka_unit_test(a_bent_cloth_is_lit_beside_the_hit)};
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
