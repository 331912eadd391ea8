/* Films that reflect light as waves: a sheet of film has the mean of its reflectance over the map, in colors that vary
 * from pixel to pixel; names of models are those of the library. */
#include "base/angle.h"
#include "base/rng.h"
#include "renderer/scattering/film_glint.h"
#include "renderer/scene/scene_glint.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/statistics_test.h"
#include "tests/support/tracer/estimate_fixture.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const double param[] = {0.2, 0.1, 0.3, 0.8, 0.6, 0.4, 6 * RAD_PER_DEG, 14 * RAD_PER_DEG, 20 * RAD_PER_DEG};
static const struct film_groups sheet_film = {
    0, 1, {{.color = {1, 1, 1}, .roughness = 0.2f, .grain_um = 10, .surface = FILM_NOISE, .optics = FILM_R_GHS}}};

/* One film along x that is a quarter wider than the tile. */
static struct scene *sheet(const struct film_groups *films)
{
    static const double y_z[1][2] = {{50e-6, 0}};
    struct fiber_set f;
    struct scene *scene = NULL;
    struct error err = {0};
    const struct scene_option o = {.films = films};
    hand_straight(&f, 1, y_z, 100e-6, 62.5e-6 / 8);
    assert_int_equal(fiber_set_add_shapes(&f, NULL), STATUS_OK);
    for (size_t k = 0; k < f.n_vertex; k++) {
        f.shape[k].ratio = 64;
        f.shape[k].long_axis[1] = 1;
    }
    if (scene_new(&f, &o, &scene, &err) != STATUS_OK) fail_msg("%s", err.text);
    fiber_set_release(&f);
    return scene;
}

static void towards(double theta_rad, double phi_rad, float w[3])
{
    w[0] = (float)(sin(theta_rad) * cos(phi_rad));
    w[1] = (float)cos(theta_rad);
    w[2] = (float)(sin(theta_rad) * sin(phi_rad));
}

/* Mean of the film's color over places of a map like the scene's. */
static void expect(const float wi[3], const float wo[3], struct sample_mean mean[3])
{
    struct wave_glint_option o = wave_glint_option_usual();
    struct wave_glint *g = NULL;
    struct error err = {0};
    const struct rng_key key = {12, 0, 0, 0};
    struct rng rng;
    o.height.length_um[0] = o.height.length_um[1] = 10;
    o.height.rms_um = 0.2 * 10 / 2; /* the slope sqrt(2) rms / length in each direction */
    if (wave_glint_new(&o, &g, &err) != STATUS_OK) fail_msg("%s", err.text);
    rng_start(&rng, &key, 0, 0);
    const struct film_glint at = {.waves = g};
    for (int k = 0; k < 6000; k++) {
        struct film_glint here = at;
        float f[3];
        for (int a = 0; a < 2; a++) here.at.center_um[a] = 1024 * rng_float(&rng);
        const struct wave_glint_query q = {
            {(double)here.at.center_um[0], (double)here.at.center_um[1]}, {wi[0], wi[2], wi[1]}, {wo[0], wo[2], wo[1]}};
        wave_glint_rgb(g, &q, METAL_N, f);
        const double white = 0.2126 * (double)f[0] + 0.7152 * (double)f[1] + 0.0722 * (double)f[2];
        sample_mean_add(&mean[0], white * (double)wi[1] * M_PI);
    }
    wave_glint_free(g);
}

/* Luminance is compared, which the way into the gamut leaves as it is. */
static void test_a_sheet_has_the_mean_of_its_map(void **state)
{
    (void)state;
    enum { N_PX = 64 };
    struct scene *scene = sheet(&sheet_film);
    struct appearance model;
    struct configuration c = {.light_theta_rad = 20 * RAD_PER_DEG,
                              .light_phi_rad = 20 * RAD_PER_DEG,
                              .camera_theta_rad = 15 * RAD_PER_DEG,
                              .camera_phi_rad = 150 * RAD_PER_DEG,
                              .crop_m = 4e-3,
                              .light = LIGHT_DIRECTIONAL,
                              .camera = CAMERA_FAR_FIELD};
    const struct render_request q = {.input = trace_input_surface(scene, scattering_find("two_lobe.v1"), param, &model),
                                     .configuration = &c,
                                     .width = N_PX,
                                     .height = N_PX,
                                     .n_sample = 1,
                                     .seed = 3};
    struct image im;
    struct sample_mean got = {0}, want[3] = {{0}};
    double colored = 0;
    float wi[3], wo[3];
    render_fixture_run(&q, 0, &im);
    for (size_t i = 0; i < (size_t)N_PX * N_PX; i++) {
        const float *v = im.pixel + i * im.n_channel;
        sample_mean_add(&got, 0.2126 * (double)v[0] + 0.7152 * (double)v[1] + 0.0722 * (double)v[2]);
        assert_true(v[0] >= 0 && v[1] >= 0 && v[2] >= 0);
        colored += fabsf(v[0] - v[2]) > 0.3f * (v[0] + v[2]);
    }
    towards(c.light_theta_rad, c.light_phi_rad, wi);
    towards(c.camera_theta_rad, c.camera_phi_rad, wo);
    expect(wi, wo, want);
    const double se = hypot(sample_mean_se(&got), sample_mean_se(&want[0]));
    print_message("mean %.4f, of the map %.4f, standard error %.4f, colored pixels %.3f\n", got.mean, want[0].mean, se,
                  colored / (N_PX * N_PX));
    /* windows 10 um wide on a map of 1 mm: pixels and places are not quite independent */
    assert_true(fabs(got.mean - want[0].mean) < 5 * se);
    assert_true(colored > 0.1 * N_PX * N_PX);
    image_release(&im);
    scene_free(scene);
}

/* The highest waves of the coarsest grains that documents may have can be made. */
static void test_the_highest_waves(void **state)
{
    (void)state;
    static const uint32_t surface[] = {FILM_NOISE, FILM_SCRATCHES};
    for (size_t i = 0; i < sizeof surface / sizeof *surface; i++) {
        struct film_groups films = sheet_film;
        struct film_material *m = films.material;
        struct film_waves w;
        struct error err = {0};
        m->surface = surface[i];
        m->grain_um = (float)FILM_MOST_WAVE_GRAIN_UM;
        m->roughness = 0.05f;
        for (film_waves_of(m, &w); film_waves_are_low(&w); film_waves_of(m, &w)) m->roughness += 0.002f;
        assert_true(m->roughness < (float)FILM_MOST_SLOPE);
        m->roughness -= 0.002f;
        struct scene *scene = sheet(&films);
        if (scene_glints_make(scene, &err) != STATUS_OK) fail_msg("surface %u: %s", m->surface, err.text);
        scene_free(scene);
    }
}

static void test_options_are_the_models(void **state)
{
    (void)state;
    for (int k = 0; k < WAVE_N_MODEL; k++)
        assert_string_equal(film_optics_names[FILM_OHS + k], wave_model_name((enum wave_model)k));
    assert_null(film_optics_names[FILM_OHS + WAVE_N_MODEL]);
    struct film_material m = {.surface = FILM_NOISE, .optics = FILM_KIRCHHOFF};
    assert_true(film_has_waves(&m));
    m.surface = FILM_SMOOTH;
    assert_false(film_has_waves(&m));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_sheet_has_the_mean_of_its_map),
        cmocka_unit_test(test_the_highest_waves),
        cmocka_unit_test(test_options_are_the_models),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
