/* The studio: what its ground shows, where its lights are seen, a cloth without its sheet, and the exposure. */
#include "renderer/estimate/render.h"
#include "renderer/mesh/mesh_shapes.h"
#include "renderer/preview/studio_ground.h"
#include "renderer/preview/studio_light.h"
#include "renderer/scene/scene_ray.h"
#include "renderer/transport/environment.h"
#include "tests/support/cloth/hand_weave.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { PX = 32 };

static struct scene *flat_scene(bool black_sheet)
{
    struct fiber_set f;
    struct scene *s = NULL;
    struct error err = {0};
    hand_weave_small(&f);
    if (scene_new(&f, &(struct scene_option){.black_sheet = black_sheet}, &s, &err) != STATUS_OK)
        fail_msg("%s", err.text);
    fiber_set_release(&f);
    return s;
}

/* A piece of 2 mm in a picture of 8 mm. */
static struct scene *small_piece(const struct scene *flat)
{
    struct mesh m;
    struct scene *s = NULL;
    struct error err = {0};
    assert_int_equal(mesh_flat((const double[2]){2.0, 2.0}, (const size_t[2]){1, 1}, &m, &err), STATUS_OK);
    if (scene_bend(flat, &m, false, &s, &err) != STATUS_OK) fail_msg("%s", err.text);
    mesh_release(&m);
    return s;
}

static struct configuration from_above(void)
{
    return (struct configuration){.camera_distance_m = 0.06, .crop_m = 0.008, .light = LIGHT_NO_LAMP};
}

static void ground_has_the_light_of_its_lights(void **state)
{
    struct scene *flat = flat_scene(false), *piece = small_piece(flat);
    struct configuration c = from_above();
    struct image im;
    struct error err;
    for (int k = 0; k < 3; k++) c.environment_rgb[k] = 0.2 * (k + 1);
    const struct ground_request q = {.scene = piece,
                                     .configuration = &c,
                                     .z_mm = scene_lowest_mm(piece) - 0.05,
                                     .albedo = 0.5,
                                     .width = PX,
                                     .height = PX,
                                     .n_sample = 4};
    const struct progress silent = {.report = NULL};
    assert_int_equal(studio_ground_render(&q, *state, &silent, &im, &err), STATUS_OK);
    const float *corner = im.pixel, *middle = im.pixel + (PX / 2 * PX + PX / 2) * im.n_channel,
                *beside = im.pixel + (PX / 2 * PX + PX / 8) * im.n_channel;
    for (int k = 0; k < 3; k++) {
        assert_true(fabs((double)corner[k] - (0.1 * (k + 1))) <= 2e-3 * (k + 1));
        assert_true(beside[k] > 0.8f * corner[k]);
        assert_true(middle[k] < 0.5f * corner[k]); /* hidden, and in the shadow where it shows between fibers */
    }
    image_release(&im);
    assert_int_equal(studio_ground_render(&(struct ground_request){.scene = flat, .configuration = &c, .n_sample = 4},
                                          *state, &silent, &im, &err),
                     STATUS_INVALID);
    scene_free(piece);
    scene_free(flat);
}

/* A cloth that lets all light of a channel through has no shadow there; one that lets none through has the whole. */
static void shadows_have_the_light_that_comes_through(void **state)
{
    static const float through[3] = {1, 0.5f, 0};
    struct scene *flat = flat_scene(false), *piece = small_piece(flat);
    struct configuration c = from_above();
    struct image im[2];
    struct error err;
    for (int k = 0; k < 3; k++) c.environment_rgb[k] = 1;
    for (int k = 0; k < 2; k++) {
        const struct ground_request q = {.scene = piece,
                                         .configuration = &c,
                                         .z_mm = scene_lowest_mm(piece) - 0.5,
                                         .albedo = 0.5,
                                         .through = k == 1 ? through : NULL,
                                         .width = PX,
                                         .height = PX,
                                         .n_sample = 4};
        const struct progress silent = {.report = NULL};
        assert_int_equal(studio_ground_render(&q, *state, &silent, &im[k], &err), STATUS_OK);
    }
    const size_t edge = (PX / 2 * PX + PX / 2 + PX / 7) * im[0].n_channel; /* just beside the piece */
    const float *dark = im[0].pixel + edge, *lit = im[1].pixel + edge;
    assert_true(dark[0] < 0.45f && fabsf(dark[0] - dark[2]) < 1e-6f);
    assert_true(fabsf(lit[0] - 0.5f) < 1e-4f && fabsf(lit[2] - dark[2]) < 0.02f); /* green guides the smoothing */
    /* a ray through the border and the side above it counts as one through two layers */
    assert_true(lit[1] < 0.5f * (lit[0] + lit[2]) + 1e-4f && lit[1] - lit[2] > 0.9f * (0.5f * (lit[0] - lit[2])));
    for (int k = 0; k < 2; k++) image_release(&im[k]);
    scene_free(piece);
    scene_free(flat);
}

static void lights_are_seen_on_the_light_table_alone(void **state)
{
    (void)state;
    for (int kind = STUDIO_ABOVE_GROUND; kind <= STUDIO_LIGHT_TABLE; kind++) {
        struct configuration c = from_above();
        struct environment *e = NULL;
        struct error err;
        float up[3], down[3];
        assert_int_equal(studio_light_set(kind, &c, &e, &err), STATUS_OK);
        assert_int_equal(configuration_check(&c, 1, &err), STATUS_OK);
        assert_int_equal(c.unseen_lights, kind != STUDIO_LIGHT_TABLE);
        environment_at(e, (const float[3]){0, 0, 1}, up);
        environment_at(e, (const float[3]){0, 0, -1}, down);
        assert_int_equal(down[0] > up[0], kind == STUDIO_LIGHT_TABLE);
        assert_true(up[0] > 0 && down[0] > 0);
        environment_free(e);
    }
}

static void a_lifted_cloth_has_no_sheet(void **state)
{
    (void)state;
    struct scene *flat = flat_scene(true), *lifted = NULL, *piece = small_piece(flat);
    struct error err;
    assert_int_equal(scene_lift(flat, &lifted, &err), STATUS_OK);
    assert_true(scene_has_black_sheet(flat));
    assert_false(scene_has_black_sheet(lifted));
    assert_int_equal(scene_lift(piece, &lifted, &err), STATUS_INVALID);
    scene_free(lifted);
    assert_int_equal(scene_n_segment(flat), scene_n_segment(piece)); /* the flat one is still there */
    scene_free(piece);
    scene_free(flat);
}

static double exposure_of(float level)
{
    struct image im;
    struct error err;
    assert_int_equal(image_init(&im, PX, PX, 3, &err), STATUS_OK);
    for (size_t i = 0; i < (size_t)3 * PX * PX / 2; i++) im.pixel[i] = level; /* the other half is beside the cloth */
    const double exposure = studio_exposure(&im);
    image_release(&im);
    return exposure;
}

static void exposure_brings_cloths_halfway(void **state)
{
    (void)state;
    assert_true(fabs(exposure_of(0.075f) / exposure_of(0.3f) - (2.0)) <= 1e-6);
    assert_true(exposure_of(0.6f) < exposure_of(0.3f));
    assert_true(fabs(exposure_of(1e-6f) - (exposure_of(1e-5f))) <= 1e-12);
}

static int make_pool(void **state)
{
    struct error err;
    return thread_pool_new(2, (struct thread_pool **)state, &err) != STATUS_OK;
}

static int free_pool(void **state)
{
    thread_pool_free(*state);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ground_has_the_light_of_its_lights),
        cmocka_unit_test(shadows_have_the_light_that_comes_through),
        cmocka_unit_test(lights_are_seen_on_the_light_table_alone),
        cmocka_unit_test(a_lifted_cloth_has_no_sheet),
        cmocka_unit_test(exposure_brings_cloths_halfway),
    };
    return cmocka_run_group_tests(tests, make_pool, free_pool);
}
