/* Films among the fibers of a scene. A sheet of film under a lamp has the radiance f_r cos th_i pi in closed form, from
 * above and from below; derivatives of a cloth with films are those of its fibers, and recorded paths replay it; a
 * cloth without films is the same bits when the scene is told of films that it has none of; pictures by tables have the
 * light of the path tracer. */
#include "base/angle.h"
#include "geometry/cloth/cloth.h"
#include "renderer/estimate/derivative_check.h"
#include "renderer/fast/precompute/fast_precompute.h"
#include "renderer/image/image.h"
#include "renderer/scattering/film_glint.h"
#include "renderer/scene/scene_glint.h"
#include "renderer/scene/scene_pack.h"
#include "renderer/scene/scene_ray.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/tracer/estimate_fixture.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { N_PARAM = 9 };
static const double param[N_PARAM] = {
    0.2, 0.1, 0.3, 0.8, 0.6, 0.4, 6 * RAD_PER_DEG, 14 * RAD_PER_DEG, 20 * RAD_PER_DEG};
static const struct film_groups sheet_film = {0, 1, {{.color = {0.9f, 0.5f, 0.2f}, .roughness = 0.3f}}};

static struct configuration seen_from(double light_deg, double camera_deg, double camera_phi_deg)
{
    return (struct configuration){.light_theta_rad = light_deg * RAD_PER_DEG,
                                  .light_phi_rad = 20 * RAD_PER_DEG,
                                  .camera_theta_rad = camera_deg * RAD_PER_DEG,
                                  .camera_phi_rad = camera_phi_deg * RAD_PER_DEG,
                                  .crop_m = 1e-3,
                                  .light = LIGHT_DIRECTIONAL,
                                  .camera = CAMERA_FAR_FIELD};
}

static struct scene *make_scene(const struct fiber_set *f, const struct film_groups *films)
{
    struct scene *scene = NULL;
    struct error err = {0};
    const struct scene_option o = {.black_sheet = false, .films = films};
    if (scene_new(f, &o, &scene, &err) != STATUS_OK) fail_msg("%s", err.text);
    return scene;
}

/* One film along x that is a quarter wider than the tile. */
static struct scene *sheet(const struct film_groups *films)
{
    static const double y_z[1][2] = {{50e-6, 0}};
    struct fiber_set f;
    hand_straight(&f, 1, y_z, 100e-6, 62.5e-6 / 8);
    assert_int_equal(fiber_set_add_shapes(&f, NULL), STATUS_OK);
    for (size_t k = 0; k < f.n_vertex; k++) {
        f.shape[k].ratio = 64;
        f.shape[k].long_axis[1] = 1;
    }
    struct scene *scene = make_scene(&f, films);
    fiber_set_release(&f);
    return scene;
}

static void towards(double theta_rad, double phi_rad, float w[3])
{
    /* the film runs along x, its normal is z: v of the fiber frame */
    w[0] = (float)(sin(theta_rad) * cos(phi_rad));
    w[1] = (float)cos(theta_rad);
    w[2] = (float)(sin(theta_rad) * sin(phi_rad));
}

static void test_sheet(void **state)
{
    (void)state;
    static const double angle_deg[][3] = {{30, 40, 190}, {60, 55, 215}, {10, 30, 80}, {150, 40, 200}};
    enum { N = sizeof angle_deg / sizeof angle_deg[0] };
    struct scene *scene = sheet(&sheet_film);
    struct appearance model;
    struct configuration c[N];
    size_t n_path[N];
    struct estimate e[N];
    assert_true(scene_has_films(scene) && !scene_shows_sections(scene) && scene_n_group(scene) == 1);
    for (int k = 0; k < N; k++) {
        c[k] = seen_from(angle_deg[k][0], angle_deg[k][1], angle_deg[k][2]);
        n_path[k] = 4000;
    }
    const struct estimate_request q = {.input =
                                           trace_input_surface(scene, scattering_find("two_lobe.v1"), param, &model),
                                       .configuration = c,
                                       .n_configuration = N,
                                       .n_path = n_path,
                                       .seed = 9};
    estimate_fixture_run(&q, 0, e);
    for (int k = 0; k < N; k++) {
        float wi[3], wo[3], f[3];
        towards(c[k].light_theta_rad, c[k].light_phi_rad, wi);
        towards(c[k].camera_theta_rad, c[k].camera_phi_rad, wo);
        film_facets_eval(&sheet_film.material[0], wi, wo, f, NULL, NULL);
        for (int a = 0; a < 3; a++) {
            /* rays that graze the edge of a film may meet the next one from inside: a thousandth */
            const double exact = (double)f[a] * fabs((double)wi[1]) * M_PI;
            if (fabs(e[k].mean[a] - exact) > 2e-3 * exact + 1e-6)
                fail_msg("%d, channel %d: %g +- %g, exact %g", k, a, e[k].mean[a], sqrt(e[k].var[a]), exact);
        }
    }
    scene_free(scene);
}

/* A sheet of flakes has the mean of all normals of its map over many pixels, and single flakes in each pixel. The map
 * is the scene's (renderer/scene/scene_glint.c). */
static void test_sheet_of_flakes(void **state)
{
    (void)state;
    enum { N_PX = 128, N = N_PX * N_PX };
    struct film_groups films = sheet_film;
    films.material[0].surface = FILM_FLAKES;
    films.material[0].grain_um = 8;
    const struct glint_option o = {
        .kind = GLINT_FLAKES, .seed = 1, .texel_um = 1, .slope = 0.3f, .roughness = 0.01f, .flake_um = 8};
    struct glint_surface *map = NULL;
    assert_int_equal(glint_surface_new(&o, &map, NULL), STATUS_OK);
    struct scene *scene = sheet(&films);
    struct appearance model;
    struct configuration c = seen_from(20, 15, 150);
    c.crop_m = 4e-3;
    struct image im;
    const struct render_request q = {.input = trace_input_surface(scene, scattering_find("two_lobe.v1"), param, &model),
                                     .configuration = &c,
                                     .width = N_PX,
                                     .height = N_PX,
                                     .n_sample = 4,
                                     .seed = 3};
    render_fixture_run(&q, 0, &im);
    double sum = 0, sum2 = 0;
    for (size_t i = 0; i < N; i++) {
        const double v = (double)im.pixel[i * im.n_channel];
        sum += v / N;
        sum2 += v * v / N;
    }
    float wi[3], wo[3], f[3], half[2];
    double length2 = 0;
    towards(c.light_theta_rad, c.light_phi_rad, wi);
    towards(c.camera_theta_rad, c.camera_phi_rad, wo);
    struct film_glint all = {.surface = map, .at = {.covariance_um2 = {1e8f, 0, 1e8f}}};
    film_glint_eval(&films.material[0], &all, wi, wo, f);
    for (int a = 0; a < 3; a++) length2 += (double)(wi[a] + wo[a]) * (double)(wi[a] + wo[a]);
    for (int a = 0; a < 2; a++) half[a] = (wi[2 * a] + wo[2 * a]) / (float)sqrt(length2);
    assert_true(glint_density(map, &all.at, half) > 0);
    const double exact = (double)f[0] * (double)wi[1] * M_PI, sd = sqrt(sum2 - sum * sum), se = sd / N_PX;
    print_message("flakes: mean %.4f +- %.4f, of the map %.4f, deviation of a pixel %.2f\n", sum, se, exact, sd);
    /* neighbouring pixels share flakes, by a third of an edge at most: twice the error of independent ones */
    assert_true(fabs(sum - exact) < 5 * 2 * se && se < 0.02 * exact);
    assert_true(sd > 0.5 * exact); /* some 15 flakes in a pixel, one of 60 of them bright */
    image_release(&im);
    scene_free(scene);
    glint_surface_free(map);
}

/* Lame: warps of fibers, every other weft a film alone, the others with a film around them. */
static void lame(struct fiber_set *f, struct film_groups *films)
{
    struct cloth_description *d = malloc(sizeof *d);
    struct error err = {0};
    assert_non_null(d);
    assert_int_equal(cloth_description_init(d, "plain", NULL), STATUS_OK);
    d->n_kind = 3;
    d->kind[0].n_fiber = 9;
    d->kind[1] = d->kind[2] = d->kind[0];
    d->kind[1].film = (struct cloth_film){60, 5, 9000, {.color = {0.95f, 0.7f, 0.3f}, .roughness = 0.3f}};
    d->kind[2].film = (struct cloth_film){120, 10, 0, {.color = {0.95f, 0.95f, 0.9f}, .roughness = 0.2f}};
    d->kind[2].n_fiber = 0;
    d->n_order[CLOTH_WEFT] = 2;
    d->order[CLOTH_WEFT][0] = 1;
    d->order[CLOTH_WEFT][1] = 2;
    d->n_yarn[CLOTH_WEFT] = d->n_yarn[CLOTH_WARP] = 4;
    cloth_description_number(d);
    fiber_set_init(f);
    if (cloth_description_check(d, &err) != STATUS_OK || cloth_build(d, NULL, NULL, NULL, f, NULL, &err) != STATUS_OK)
        fail_msg("%s: %s", err.field, err.text);
    cloth_film_groups(d, films);
    free(d);
}

static void test_derivatives(void **state)
{
    (void)state;
    struct fiber_set f;
    struct film_groups films;
    struct appearance model;
    static struct derivative_check check;
    lame(&f, &films);
    struct scene *scene = make_scene(&f, &films);
    struct configuration c[2] = {seen_from(30, 20, 200), seen_from(150, 40, 100)};
    double two[2 * N_PARAM];
    assert_int_equal(scene_n_group(scene), 2);
    memcpy(two, param, sizeof param);
    memcpy(two + N_PARAM, param, sizeof param);
    two[N_PARAM] = 0.5;
    for (size_t n_set = 1; n_set <= 2; n_set++) {
        struct derivative_check_request q = {
            .input = trace_input_surface(scene, scattering_find("two_lobe.v1"), two, &model),
            .configuration = c,
            .n_configuration = 2,
            .n_path = 600,
            .seed = 4};
        struct error err = {0};
        q.input.n_set = n_set;
        if (derivative_check_run(&q, NULL, &check, &err) != STATUS_OK) fail_msg("%s", err.text);
        /* as in test_derivative_check: rounding, and 4.7 standard deviations of the noise */
        for (size_t p = 0; p < n_set * N_PARAM; p++)
            if (check.error[p] > 2e-3 + check.noise[p] + 4.7 * check.noise_se[p])
                fail_msg("%zu sets, parameter %zu: %g, noise %g", n_set, p, check.error[p], check.noise[p]);
    }
    scene_free(scene);
    fiber_set_release(&f);
}

static struct estimate mean_of(const struct radiance_input *in, const struct configuration *c, size_t n_path)
{
    struct estimate e;
    const struct estimate_request q = {
        .input = *in, .configuration = c, .n_configuration = 1, .n_path = &n_path, .seed = 7};
    estimate_fixture_run(&q, 0, &e);
    return e;
}

static void test_no_films_same_bits(void **state)
{
    (void)state;
    static const struct film_groups none = {0};
    struct fiber_set f;
    struct appearance model;
    hand_weave_small(&f);
    const struct configuration c = seen_from(30, 20, 200);
    struct scene *plain = make_scene(&f, NULL), *told = make_scene(&f, &none);
    const struct radiance_input a = trace_input_surface(plain, scattering_find("two_lobe.v1"), param, &model);
    struct radiance_input b = a;
    b.scene.fibers = told;
    const struct estimate x = mean_of(&a, &c, 2000), y = mean_of(&b, &c, 2000);
    assert_memory_equal(x.mean, y.mean, sizeof x.mean);
    scene_free(plain);
    scene_free(told);
    fiber_set_release(&f);
}

/* Another rank's scene has the same films; materials that cannot be are refused. */
static void test_packed(void **state)
{
    (void)state;
    struct film_groups films = sheet_film;
    films.material[0].surface = FILM_FLAKES;
    films.material[0].grain_um = 8;
    for (int k = 0; k < 4; k++) {
        struct film_groups sent = films;
        struct byte_pack pack = {0};
        struct scene *copy = NULL;
        if (k == 1) sent.material[0].surface = FILM_FLAKES + 1;
        if (k == 2) sent.material[0].grain_um = NAN;
        if (k == 3) sent.material[0].color[1] = 2;
        struct scene *scene = sheet(&sent);
        scene_pack(scene, &pack);
        struct byte_view view = {.data = pack.data, .n = pack.n};
        assert_int_equal(scene_unpack(&view, &copy, NULL), k == 0 ? STATUS_OK : STATUS_FORMAT);
        if (k == 0) assert_memory_equal(scene_films(copy), &films, sizeof films);
        if (k == 0) assert_int_equal(scene_glints_make(copy, NULL), STATUS_OK);
        byte_pack_release(&pack);
        scene_free(copy);
        scene_free(scene);
    }
}

static void test_tables(void **state)
{
    (void)state;
    enum { N_TRACED = 3 };
    struct fiber_set f;
    struct film_groups films;
    struct appearance model;
    struct fast_tables tables = {0};
    struct error err = {0};
    lame(&f, &films);
    struct scene *scene = make_scene(&f, &films);
    struct radiance_input in = trace_input_surface(scene, scattering_find("two_lobe.v1"), param, &model);
    const struct fast_precompute_request q = {.scene = scene,
                                              .model = model.surface,
                                              .param = param,
                                              .n_set = 1,
                                              .deep_traced = N_TRACED,
                                              .deep_edge = 8,
                                              .deep_paths = 400000,
                                              .n_path = 100,
                                              .no_visibility = true};
    if (fast_precompute(&q, NULL, NULL, &tables, &err) != STATUS_OK) fail_msg("%s", err.text);
    const struct fast_option fast = {.tables = &tables, .n_traced = N_TRACED, .deep = true};
    static const double angle_deg[][3] = {{30, 20, 200}, {50, 40, 80}};
    for (int k = 0; k < 2; k++) {
        const struct configuration c = seen_from(angle_deg[k][0], angle_deg[k][1], angle_deg[k][2]);
        const struct estimate path = mean_of(&in, &c, 20000);
        struct radiance_input by_tables = in;
        by_tables.fast = &fast;
        const struct estimate quick = mean_of(&by_tables, &c, 20000);
        for (int a = 0; a < 3; a++) {
            const double se = sqrt(path.var[a] + quick.var[a]);
            /* views and lights of the deep table are 8 steps apart and its walks are noisy: 2 % of all light */
            if (fabs(path.mean[a] - quick.mean[a]) > 5 * se + 0.02 * path.mean[a])
                fail_msg("%d, channel %d: path %g, tables %g, se %g", k, a, path.mean[a], quick.mean[a], se);
            print_message("view %d, channel %d: path %.5f, tables %.5f, se %.5f\n", k, a, path.mean[a], quick.mean[a],
                          se);
        }
    }
    fast_tables_release(&tables);
    scene_free(scene);
    fiber_set_release(&f);
}

int main(void)
{
    const struct CMUnitTest test[] = {cmocka_unit_test(test_sheet),       cmocka_unit_test(test_sheet_of_flakes),
                                      cmocka_unit_test(test_derivatives), cmocka_unit_test(test_no_films_same_bits),
                                      cmocka_unit_test(test_tables),      cmocka_unit_test(test_packed)};
    return cmocka_run_group_tests(test, NULL, NULL);
}
