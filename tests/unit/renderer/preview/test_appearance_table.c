/* Tables of appearance: the grid of directions, the textures, agreement of the mean with the path tracer's pictures. */
#include "renderer/preview/appearance_table.h"

#include "base/angle.h"
#include "base/rng.h"
#include "renderer/estimate/estimate.h"
#include "renderer/estimate/render.h"
#include "renderer/preview/direction_grid.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static double start[SCATTERING_MAX_PARAM];
static struct appearance model;

static int set_up(void **state)
{
    (void)state;
    const struct scattering_model *m = scattering_find("two_lobe.v1");
    for (size_t p = 0; p < m->n_param; p++) start[p] = m->param[p].start;
    return 0;
}

static struct scene *small_cloth(bool black_sheet)
{
    struct fiber_set f;
    struct scene *scene = NULL;
    struct error err = {0};
    hand_weave_small(&f);
    if (scene_new(&f, &(struct scene_option){black_sheet}, &scene, &err) != STATUS_OK) fail_msg("%s", err.text);
    fiber_set_release(&f);
    return scene;
}

static const double grey[3] = {0.8, 0.6, 0.4}; /* of isotropic.v1 */

static void make(const struct scene *scene, const char *id, const struct appearance_table_option *o, size_t n_thread,
                 struct appearance_table *t)
{
    const double *param = strcmp(id, "isotropic.v1") == 0 ? grey : start;
    struct radiance_input in = trace_input_surface(scene, scattering_find(id), param, &model);
    struct thread_pool *pool = NULL;
    struct error err = {0};
    assert_int_equal(thread_pool_new(n_thread, &pool, &err), STATUS_OK);
    if (appearance_table_make(&in, o, pool, NULL, t, &err) != STATUS_OK) fail_msg("%s", err.text);
    thread_pool_free(pool);
}

static void directions_and_squares(void **state)
{
    (void)state;
    struct rng r;
    rng_start(&r, &(struct rng_key){1, 0, 0, 0}, 0, 0);
    for (int i = 0; i < 2000; i++) {
        size_t side = (size_t)i % 2, cell[4];
        double square[2], back[2], d[3], weight[4], sum = 0, at[3] = {0, 0, 0};
        for (int a = 0; a < 2; a++) square[a] = 0.025 + 0.95 * rng_double(&r);
        direction_grid_direction(square, side, d);
        direction_grid_square(d, back);
        assert_true(fabs(d[0] * d[0] + d[1] * d[1] + d[2] * d[2] - 1) < 1e-12 && (d[2] >= 0) == (side == 0));
        assert_true(hypot(back[0] - square[0], back[1] - square[1]) < 1e-12);
        direction_grid_cells(d, 20, cell, weight);
        for (int k = 0; k < 4; k++) {
            const double middle[2] = {((double)(cell[k] % 20) + 0.5) / 20, ((double)(cell[k] / 20 % 20) + 0.5) / 20};
            double e[3];
            direction_grid_direction(middle, cell[k] / 400, e);
            sum += weight[k];
            for (int a = 0; a < 3; a++) at[a] += weight[k] * e[a];
        }
        assert_true(fabs(sum - 1) < 1e-12);
        assert_true(acos(fmin(1, at[0] * d[0] + at[1] * d[1] + at[2] * d[2])) < 0.12); /* a cell has 0.11 rad at most */
    }
}

/* Lights of both hemispheres are in the table of a cloth without a sheet. Threads change no bit. */
static void textures_are_orthonormal(void **state)
{
    (void)state;
    const struct appearance_table_option o = {
        .texels = 64, .view_edge = 2, .light_edge = 3, .n_basis = 4, .n_path = 2000, .seed = 1};
    struct scene *scene = small_cloth(false);
    struct appearance_table t, other;
    make(scene, "two_lobe.v1", &o, 1, &t);
    make(scene, "two_lobe.v1", &o, 2, &other);
    assert_true(t.n_side == 2 && t.width == 8 && t.height == 8);
    size_t n = t.width * t.height, n_value = 2 * 4 * 2 * 9 * 4 * 3;
    assert_memory_equal(t.weight, other.weight, 4 * n * sizeof(float));
    assert_memory_equal(t.value, other.value, n_value * sizeof(float));
    for (size_t j = 0; j < 4; j++)
        for (size_t k = 0; k <= j; k++) {
            double sum = 0;
            for (size_t i = 0; i < n; i++) sum += (double)(t.weight[j * n + i] * t.weight[k * n + i]) / (double)n;
            assert_true(fabs(sum - (j == k)) < 1e-4);
        }
    for (size_t i = 0; i < n; i++) assert_true(t.weight[i] == 1);
    appearance_table_release(&t);
    appearance_table_release(&other);
    scene_free(scene);
}

/* The mean of the tile in nine directions, against pictures with the same lamp and a far camera. Fibers scatter evenly,
 * so that paths differ by about their mean: 66 of them in a cell, interpolated and smoothed, leave 2 to 3 % of a mean
 * and 1 % of nine, and the 8,192 of a picture 1.5 %. */
static void the_mean_is_that_of_the_path_tracer(void **state)
{
    (void)state;
    const struct appearance_table_option o = {
        .texels = 16, .view_edge = 10, .light_edge = 12, .n_basis = 4, .n_path = 60000, .seed = 2};
    struct scene *scene = small_cloth(true);
    struct appearance_table t;
    make(scene, "isotropic.v1", &o, 2, &t);
    double worst = 0, sum = 0, sum_table = 0;
    for (int i = 0; i < 9; i++) {
        const struct configuration c = {.light = LIGHT_DIRECTIONAL,
                                        .light_theta_rad = (15 + 20 * (i % 3)) * RAD_PER_DEG,
                                        .light_phi_rad = 40 * i * RAD_PER_DEG,
                                        .camera = CAMERA_FAR_FIELD,
                                        .camera_theta_rad = (10 + 20 * (i / 3)) * RAD_PER_DEG,
                                        .camera_phi_rad = 1,
                                        .light_distance_m = 1,
                                        .lamp_side_m = 0.1,
                                        .camera_distance_m = 1,
                                        .crop_m = 0.01};
        const struct render_request q = {.input =
                                             trace_input_surface(scene, scattering_find("isotropic.v1"), grey, &model),
                                         .configuration = &c,
                                         .width = 16,
                                         .height = 16,
                                         .n_sample = 32,
                                         .seed = 9};
        struct image im;
        struct error err = {0};
        if (render_run(&q, NULL, NULL, &im, &err) != STATUS_OK) fail_msg("%s", err.text);
        double mean = 0, rgb[3], l = c.light_theta_rad, v = c.camera_theta_rad;
        for (size_t k = 0; k < 256; k++) mean += (double)im.pixel[k * im.n_channel + 1] / 256;
        image_release(&im);
        const double wo[3] = {sin(v) * cos(c.camera_phi_rad), sin(v) * sin(c.camera_phi_rad), cos(v)},
                     wi[3] = {sin(l) * cos(c.light_phi_rad), sin(l) * sin(c.light_phi_rad), cos(l)};
        appearance_table_mean(&t, wo, wi, rgb);
        worst = fmax(worst, fabs(rgb[1] / mean - 1));
        sum += mean;
        sum_table += rgb[1];
    }
    if (worst > 0.12) fail_msg("a mean differs by %g", worst);
    if (fabs(sum_table / sum - 1) > 0.04) fail_msg("the means differ by %g together", sum_table / sum - 1);
    if (!(t.mean_rel_rms > 0 && t.mean_rel_rms < 0.12 && t.mean_rel_noise > 0))
        fail_msg("the table states an error of %g, noise %g, after %zu steps of smoothing", t.mean_rel_rms,
                 t.mean_rel_noise, t.n_smooth);
    appearance_table_release(&t);
    scene_free(scene);
}

static void what_is_refused(void **state)
{
    (void)state;
    struct scene *scene = small_cloth(true);
    struct radiance_input in = trace_input_surface(scene, scattering_find("two_lobe.v1"), start, &model);
    struct appearance_table t;
    struct error err = {0};
    const struct appearance_table_option o = {.texels = 16, .view_edge = 0, .light_edge = 3, .n_basis = 4};
    assert_int_equal(appearance_table_make(&in, &o, NULL, NULL, &t, &err), STATUS_INVALID);
    const struct appearance_table_option small = {
        .texels = 16, .view_edge = 2, .light_edge = 2, .n_basis = 4, .n_path = 100};
    const atomic_bool cancel = true;
    assert_int_equal(appearance_table_make(&in, &small, NULL, &(struct progress){.cancel = &cancel}, &t, &err),
                     STATUS_CANCELLED);
    in.scene.fibers = NULL;
    assert_int_equal(appearance_table_make(&in, &o, NULL, NULL, &t, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "sees no fibers"));
    scene_free(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(directions_and_squares),
        cmocka_unit_test(textures_are_orthonormal),
        cmocka_unit_test(the_mean_is_that_of_the_path_tracer),
        cmocka_unit_test(what_is_refused),
    };
    return cmocka_run_group_tests(tests, set_up, NULL);
}
