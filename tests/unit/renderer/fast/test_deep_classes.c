/* Deep light of weft and warp: each class of fibers has the table of what its own hits show. */
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
    static const float up[3] = {0, 0, 1}, one[3] = {1, 1, 1}, weft[3] = {0.9f, 0.1f, 0.2f}, warp[3] = {-0.1f, -0.9f, 0};
    double traced[2];
    float rgb[2][3] = {{0}};
    make_layers(&layers);
    traced_by_class(&layers, traced);
    for (size_t k = 0; k < 2; k++) deep_light_add(&layers.tables.deep, k, up, up, one, rgb[k]);
    double ratio = (double)rgb[0][0] / (double)rgb[1][0], expected = traced[0] / traced[1];
    print_message("deep light of lower over upper fibers: %.3f, traced %.3f\n", ratio, expected);
    assert_true(fabs(ratio - expected) < 0.25 * fabs(1 / ratio - expected));
    assert_true(deep_light_class(weft) == 1 && deep_light_class(warp) == 0);
    fast_tables_release(&layers.tables);
    scene_free(layers.scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(classes_have_tables_of_their_own)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
