/* Deep light of weft and warp, and of fibers that rise and fall: each kind of fiber has the table of what its own hits
 * show. */
#include "renderer/fast/precompute/fast_precompute.h"
#include "renderer/scene/scene_ray.h"
#include "renderer/transport/surface/path_tracer.h"
#include "tests/support/cloth/hand_weave.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

struct cloth {
    struct scene *scene;
    const struct scattering_model *model;
    double param[SCATTERING_MAX_PARAM];
    struct fast_tables tables;
};

/* Fibers along x over fibers along y, all of isotropic scattering. */
static void make_layers(struct cloth *c)
{
    enum { N = 4 };
    double place_m[2 * N][2];
    struct fiber_set f;
    struct error err = {0};
    for (int i = 0; i < 2 * N; i++) {
        place_m[i][0] = (i % N + 0.5) * 1e-4;
        place_m[i][1] = i < N ? 0 : -6e-5;
    }
    hand_straight(&f, 2 * N, (const double(*)[2])place_m, N * 1e-4, 2e-5);
    for (int v = 2 * N; v < 4 * N; v++) {
        float *p = f.position_m + 3 * v, x = p[0];
        p[0] = p[1];
        p[1] = x;
    }
    c->model = scattering_find("isotropic.v1");
    for (size_t p = 0; p < c->model->n_param; p++) c->param[p] = 0.9;
    if (scene_new(&f, &(struct scene_option){.black_sheet = true}, &c->scene, &err) != STATUS_OK)
        fail_msg("%s", err.text);
    fiber_set_release(&f);
    const struct fast_precompute_request q = {.scene = c->scene,
                                              .model = c->model,
                                              .param = c->param,
                                              .n_path = 10,
                                              .no_visibility = true,
                                              .deep_traced = 1,
                                              .deep_edge = 3,
                                              .deep_paths = 40000};
    if (fast_precompute(&q, NULL, NULL, &c->tables, &err) != STATUS_OK) fail_msg("%s", err.text);
}

/* Light from above that the cloth scatters upwards more than once, over hits of each class. */
static void traced_by_class(const struct cloth *c, double mean[2])
{
    const struct configuration above = {.light = LIGHT_DIRECTIONAL, .camera_distance_m = 1.0, .crop_m = 0.01};
    struct parameter_sets sets;
    struct path_setting whole;
    double n[2] = {0, 0};
    assert_int_equal(parameter_sets_init(&sets, c->scene, c->model, c->param, 1, NULL), STATUS_OK);
    path_setting_init_sets(&whole, c->scene, &sets, &above, false);
    struct path_setting once = whole;
    once.n_traced = 1;
    once.guided_paths = false;
    mean[0] = mean[1] = 0;
    for (uint32_t i = 0; i < 8192; i++) {
        struct rng rng;
        struct scene_ray ray[3];
        struct scene_hit hit;
        struct path_result path[2];
        rng_start(&rng, &(struct rng_key){3, 0, 0, 0}, i, 0);
        const double from[3] = {0.4 * rng_double(&rng), 0.4 * rng_double(&rng), 1}, down[3] = {0, 0, -1};
        if (!scene_ray_enter(c->scene, from, down, &ray[0])) continue;
        ray[1] = ray[2] = ray[0];
        if (!scene_trace(c->scene, &ray[0], &hit)) continue;
        path_trace(&whole, &ray[1], &rng, &path[0], NULL);
        path_trace(&once, &ray[2], &rng, &path[1], NULL);
        size_t k = deep_light_class(hit.tangent);
        mean[k] += (double)(path[0].radiance[0] - path[1].radiance[0]);
        n[k]++;
    }
    for (int k = 0; k < 2; k++) mean[k] /= n[k];
    parameter_sets_release(&sets);
}

/* Each class has the deep light of its own fibers. */
static void classes_have_tables_of_their_own(void **state)
{
    (void)state;
    struct cloth layers = {0};
    static const float up[3] = {0, 0, 1}, one[3] = {1, 1, 1}, weft[3] = {1, 0, 0}, warp[3] = {-0.1f, -0.99f, 0};
    double traced[2];
    float rgb[2][3] = {{0}};
    make_layers(&layers);
    traced_by_class(&layers, traced);
    for (size_t k = 0; k < 2; k++) deep_light_add(&layers.tables.deep, k == 1 ? weft : warp, up, up, one, rgb[k]);
    double ratio = (double)rgb[0][0] / (double)rgb[1][0], expected = traced[0] / traced[1];
    print_message("deep light of lower over upper fibers: %.3f, traced %.3f\n", ratio, expected);
    assert_true(fabs(ratio - expected) < 0.25 * fabs(1 / ratio - expected));
    assert_true(deep_light_class(weft) == 1 && deep_light_class(warp) == 0);
    fast_tables_release(&layers.tables);
    scene_free(layers.scene);
}

/* Sums over the hits of a weave, seen from above under a low lamp across the warp, of fibers along y that fall and that
 * rise by more than 0.2: what paths find beyond the first hit, the squares of that, and what the table has. */
struct tilted {
    double traced[2], square[2], table[2], n[2];
};

static void sum_by_tilt(const struct cloth *c, struct tilted *t)
{
    const struct configuration low = {.light = LIGHT_DIRECTIONAL,
                                      .light_theta_rad = 1.0,
                                      .light_phi_rad = M_PI_2,
                                      .camera_distance_m = 1.0,
                                      .crop_m = 0.01};
    static const float up[3] = {0, 0, 1}, one[3] = {1, 1, 1};
    const float towards[3] = {0, sinf(1.0f), cosf(1.0f)};
    struct parameter_sets sets;
    struct path_setting whole;
    assert_int_equal(parameter_sets_init(&sets, c->scene, c->model, c->param, 1, NULL), STATUS_OK);
    path_setting_init_sets(&whole, c->scene, &sets, &low, false);
    struct path_setting once = whole;
    once.n_traced = 1;
    once.guided_paths = false;
    for (uint32_t i = 0; i < 20000; i++) {
        struct rng rng;
        struct scene_ray ray[3];
        struct scene_hit hit;
        struct path_result path[2];
        float rgb[3] = {0, 0, 0};
        rng_start(&rng, &(struct rng_key){5, 0, 0, 0}, i, 0);
        const double from[3] = {0.55 * rng_double(&rng), 0.55 * rng_double(&rng), 1}, down[3] = {0, 0, -1};
        if (!scene_ray_enter(c->scene, from, down, &ray[0])) continue;
        ray[1] = ray[2] = ray[0];
        if (!scene_trace(c->scene, &ray[0], &hit) || deep_light_class(hit.tangent) != 0) continue;
        float tilt = hit.tangent[1] < 0 ? -hit.tangent[2] : hit.tangent[2];
        if (fabsf(tilt) < 0.2f) continue;
        path_trace(&whole, &ray[1], &rng, &path[0], NULL);
        path_trace(&once, &ray[2], &rng, &path[1], NULL);
        deep_light_add(&c->tables.deep, hit.tangent, up, towards, one, rgb);
        size_t k = tilt > 0;
        double deep = (double)(path[0].radiance[1] - path[1].radiance[1]);
        t->traced[k] += deep;
        t->square[k] += deep * deep;
        t->table[k] += (double)rgb[1];
        t->n[k]++;
    }
    parameter_sets_release(&sets);
}

/* Fibers that rise towards a low lamp have other deep light than those that fall, and the table has most of that. */
static void fibers_that_rise_and_fall(void **state)
{
    (void)state;
    static const double wide[] = {0.4, 0.4, 0.4, 0.5, 0.5, 0.5, 10, 10, 40};
    struct cloth weave = {.model = scattering_find("two_lobe.v1")};
    struct fiber_set f;
    struct error err = {0};
    struct tilted t = {0};
    hand_weave_small(&f);
    if (scene_new(&f, &(struct scene_option){.black_sheet = true}, &weave.scene, &err) != STATUS_OK)
        fail_msg("%s", err.text);
    fiber_set_release(&f);
    for (size_t p = 0; p < weave.model->n_param; p++)
        weave.param[p] = param_from_file_unit(&weave.model->param[p], wide[p]);
    const struct fast_precompute_request q = {.scene = weave.scene,
                                              .model = weave.model,
                                              .param = weave.param,
                                              .n_path = 10,
                                              .no_visibility = true,
                                              .deep_traced = 1,
                                              .deep_edge = 6,
                                              .deep_paths = 250000};
    if (fast_precompute(&q, NULL, NULL, &weave.tables, &err) != STATUS_OK) fail_msg("%s", err.text);
    sum_by_tilt(&weave, &t);
    double mean[2], table[2], var = 0;
    for (int k = 0; k < 2; k++) {
        mean[k] = t.traced[k] / t.n[k];
        table[k] = t.table[k] / t.n[k];
        var += (t.square[k] / t.n[k] - mean[k] * mean[k]) / t.n[k];
    }
    double traced = mean[1] - mean[0], tabled = table[1] - table[0];
    print_message("rising less falling: traced %.4f +- %.4f, table %.4f; falling %.4f, %.4f\n", traced, sqrt(var),
                  tabled, mean[0], table[0]);
    assert_true(fabs(traced) > 8 * sqrt(var));
    assert_true(fabs(tabled - traced) < 0.4 * fabs(traced) + 4 * sqrt(var));
    fast_tables_release(&weave.tables);
    scene_free(weave.scene);
}

/* Weights sum to 1 and give the tilt back within the nodes; a tangent and its opposite are the same fiber. */
static void kinds_of_tangents(void **state)
{
    (void)state;
    for (int i = 0; i < 64; i++) {
        const float phi = 0.1f * (float)i, z = 0.6f * sinf(0.7f * (float)i), across = sqrtf(1 - z * z);
        const float tangent[3] = {across * cosf(phi), across * sinf(phi), z}, back[3] = {-tangent[0], -tangent[1], -z};
        size_t kind[2], kind_back[2], i_class = deep_light_class(tangent);
        double w[2], w_back[2], tilt = copysign((double)z, (double)(z * tangent[i_class == 1 ? 0 : 1])), node[2];
        deep_light_kinds(tangent, kind, w);
        deep_light_kinds(back, kind_back, w_back);
        for (int k = 0; k < 2; k++) {
            assert_true(kind[k] == kind_back[k] && fabs(w[k] - w_back[k]) < 1e-6);
            assert_true(kind[k] / DEEP_LIGHT_N_TILT == i_class && w[k] >= 0);
            node[k] =
                (double)DEEP_LIGHT_TILT * (2.0 * (double)(kind[k] % DEEP_LIGHT_N_TILT) / (DEEP_LIGHT_N_TILT - 1) - 1);
        }
        double expected = fmin(fmax(tilt, -(double)DEEP_LIGHT_TILT), (double)DEEP_LIGHT_TILT);
        assert_true(fabs(w[0] + w[1] - 1) < 1e-12 && fabs(w[0] * node[0] + w[1] * node[1] - expected) < 1e-6);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(classes_have_tables_of_their_own),
                                       cmocka_unit_test(fibers_that_rise_and_fall),
                                       cmocka_unit_test(kinds_of_tangents)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
