/* Lights and cameras other than the square lamp and the perspective camera, against closed forms, quadrature, or each
 * other. Tolerances are 4 standard errors (for several dozen comparisons) plus the stated remainders.
 */
#include "renderer/estimate/estimate.h"
#include "renderer/transport/environment.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/statistics_test.h"
#include "tests/support/tracer/environment/painted_environment.h"
#include "tests/support/tracer/orbit_configurations.h"
#include "tests/support/tracer/reference_two_lobe.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/angle.h"
#include "base/rng.h"
#include "tests/support/tracer/trace_input.h"

static struct thread_pool *pool;
static struct scene *weave[2]; /* without and with the black sheet */

static int set_up(void **state)
{
    (void)state;
    struct fiber_set f;
    status st = thread_pool_new(0, &pool, NULL);
    hand_weave_small(&f);
    for (int i = 0; i < 2 && st == STATUS_OK; i++)
        st = scene_new(&f, &(struct scene_option){.black_sheet = i == 1}, &weave[i], NULL);
    fiber_set_release(&f);
    return st != STATUS_OK;
}

static int tear_down(void **state)
{
    (void)state;
    scene_free(weave[0]);
    scene_free(weave[1]);
    thread_pool_free(pool);
    return 0;
}

static struct estimate run(const struct scene *scene, const char *model, const double *param,
                           const struct configuration *c, size_t n_path, uint64_t seed)
{
    struct estimate e;
    struct error err = {0};
    struct appearance appearance;
    struct estimate_request q = {.input = trace_input_surface(scene, scattering_find(model), param, &appearance),
                                 .configuration = c,
                                 .n_configuration = 1,
                                 .n_path = &n_path,
                                 .seed = seed};
    if (estimate_run(&q, pool, NULL, &e, &err) != STATUS_OK) fail_msg("%s", err.text);
    return e;
}

static void same(const char *what, int i, const struct estimate *a, const struct estimate *b, double remainder)
{
    for (int k = 0; k < 3; k++) {
        double se = sqrt(a->var[k] + b->var[k]), off = fabs(a->mean[k] - b->mean[k]);
        if (!(off <= 4 * se + remainder * fabs(b->mean[k])) || se > 0.03 * fabs(b->mean[k]))
            fail_msg("%s, configuration %d, channel %d: %.6g and %.6g, standard error %.2g", what, i, k, a->mean[k],
                     b->mean[k], se);
    }
}

static void coloured(double param[9])
{
    static const double p[9] = {0.2, 0.1, 0.3, 0.8, 0.6, 0.4, 4 * RAD_PER_DEG, 14 * RAD_PER_DEG, 20 * RAD_PER_DEG};
    memcpy(param, p, sizeof p);
}

/* One straight, nearly black fiber: coverage * pi * S cos th_i, for lamps above and, without the sheet, below. */
static void directional_lamp_closed_form(void **state)
{
    (void)state;
    static const double angle_deg[][5] = {/* camera theta, phi, lamp theta, phi, rotation */
                                          {0, 0, 30, 90, 0},     {30, 0, 30, 180, 0}, {40, 90, 35, 270, 90},
                                          {20, 45, 30, 235, 45}, {60, 180, 62, 5, 0}, {10, 90, 150, 270, 0},
                                          {35, 45, 130, 215, 20}};
    static const double param[9] = {
        0.01, 0.02, 0.03, 0.03, 0.02, 0.01, 8 * RAD_PER_DEG, 30 * RAD_PER_DEG, 40 * RAD_PER_DEG};
    const double tile_m = 0.4e-3, radius_m = 5e-6, y_z[1][2] = {{0.13e-3, 0}};
    struct fiber_set f;
    struct scene *with_sheet[2] = {NULL, NULL};
    hand_straight(&f, 1, y_z, tile_m, radius_m);
    for (int b = 0; b < 2; b++)
        assert_int_equal(scene_new(&f, &(struct scene_option){.black_sheet = b == 1}, &with_sheet[b], NULL), STATUS_OK);
    for (size_t i = 0; i < sizeof angle_deg / sizeof angle_deg[0]; i++) {
        const double *a = angle_deg[i];
        const struct scene *scene = with_sheet[a[2] < 90];
        struct configuration c = {.light_theta_rad = a[2] * RAD_PER_DEG,
                                  .light_phi_rad = a[3] * RAD_PER_DEG,
                                  .camera_theta_rad = a[0] * RAD_PER_DEG,
                                  .camera_phi_rad = a[1] * RAD_PER_DEG,
                                  .cloth_rotation_rad = a[4] * RAD_PER_DEG,
                                  .crop_m = 8 * tile_m,
                                  .light = LIGHT_DIRECTIONAL,
                                  .camera = CAMERA_FAR_FIELD};
        double w[2][3];
        for (int k = 0; k < 2; k++) {
            double theta = k == 0 ? c.light_theta_rad : c.camera_theta_rad;
            double phi = (k == 0 ? c.light_phi_rad : c.camera_phi_rad) - c.cloth_rotation_rad;
            w[k][0] = sin(theta) * cos(phi);
            w[k][1] = sin(theta) * sin(phi);
            w[k][2] = cos(theta);
        }
        struct estimate e = run(scene, "two_lobe.v1", param, &c, 200000, 3);
        for (int k = 0; k < 3; k++) {
            double want = 2 * radius_m / tile_m * M_PI * reference_s(param, w[0], w[1], k) * hypot(w[0][1], w[0][2]);
            double se = sqrt(e.var[k]);
            if (!(fabs(e.mean[k] - want) < 4 * se + 5e-3 * want) || se > 0.05 * want)
                fail_msg("view %zu, channel %d: %.6g +- %.2g, closed form %.6g", i, k, e.mean[k], se, want);
        }
    }
    for (int b = 0; b < 2; b++) scene_free(with_sheet[b]);
    fiber_set_release(&f);
}

/* The light of a lamp 30 m away and 1 m wide is nearly parallel: angles differ by a degree at most. */
static void directional_lamp_is_a_distant_one(void **state)
{
    (void)state;
    struct configuration c[16];
    double param[9];
    orbit_configurations_16(c);
    coloured(param);
    for (int i = 0; i < 16; i += 5) {
        struct configuration far = c[i];
        far.light_distance_m = 30;
        far.lamp_side_m = 0.3;
        struct estimate a = run(weave[1], "two_lobe.v1", param, &far, 50000, 4);
        far.light = LIGHT_DIRECTIONAL;
        struct estimate b = run(weave[1], "two_lobe.v1", param, &far, 50000, 5);
        same("directional and distant lamp", i, &a, &b, 2e-3);
    }
}

/* The far-field camera and a perspective one at 100 m with the same crop. */
static void far_field_camera_is_a_distant_one(void **state)
{
    (void)state;
    struct configuration c[16];
    double param[9];
    orbit_configurations_16(c);
    coloured(param);
    for (int i = 0; i < 16; i += 3) {
        c[i].camera_distance_m = 100;
        struct estimate a = run(weave[1], "two_lobe.v1", param, &c[i], 60000, 6);
        c[i].camera = CAMERA_FAR_FIELD;
        c[i].camera_distance_m = 0;
        struct estimate b = run(weave[1], "two_lobe.v1", param, &c[i], 60000, 7);
        same("far-field camera and distant camera", i, &a, &b, 2e-3);
    }
}

static void constant_environment_is_a_furnace(void **state)
{
    (void)state;
    struct configuration c[16];
    const double white[3] = {1, 1, 1};
    orbit_configurations_16(c);
    for (int i = 0; i < 16; i += 3) {
        c[i].light = LIGHT_NO_LAMP;
        c[i].environment_rgb[0] = 0.5;
        c[i].environment_rgb[1] = 1;
        c[i].environment_rgb[2] = 3;
        struct estimate e = run(weave[0], "isotropic.v1", white, &c[i], 20000, 8);
        for (int k = 0; k < 3; k++)
            if (fabs(e.mean[k] / c[i].environment_rgb[k] - 1) > 1e-3) fail_msg("configuration %d: %.6g", i, e.mean[k]);
    }
}

static void constant_picture_is_the_constant_environment(void **state)
{
    (void)state;
    struct configuration c[16];
    struct environment *e = painted_environment(16, 8, paint_constant);
    double param[9];
    orbit_configurations_16(c);
    coloured(param);
    for (int i = 0; i < 16; i += 3) {
        const struct scene *scene = weave[i % 2];
        struct configuration k = c[i];
        k.light = LIGHT_NO_LAMP;
        k.environment_rgb[0] = 0.7;
        k.environment_rgb[1] = 1;
        k.environment_rgb[2] = 1.3;
        struct estimate a = run(scene, "two_lobe.v1", param, &k, 60000, 9);
        memset(k.environment_rgb, 0, sizeof k.environment_rgb);
        k.environment = e;
        struct estimate b = run(scene, "two_lobe.v1", param, &k, 60000, 10);
        same("constant environment and constant picture", i, &a, &b, 0);
    }
    environment_free(e);
}

/* Radiance is additive: that of lamp and sky together is the sum of that of each. */
static void lights_add_up(void **state)
{
    (void)state;
    struct configuration c[16];
    struct environment *e = painted_environment(64, 32, paint_sky);
    double param[9];
    orbit_configurations_16(c);
    coloured(param);
    for (int i = 1; i < 16; i += 5) {
        struct configuration lamp = c[i], sky = c[i], both = c[i];
        sky.light = LIGHT_NO_LAMP;
        sky.environment = both.environment = e;
        struct estimate a = run(weave[0], "two_lobe.v1", param, &lamp, 60000, 11);
        struct estimate b = run(weave[0], "two_lobe.v1", param, &sky, 60000, 12);
        struct estimate sum = run(weave[0], "two_lobe.v1", param, &both, 60000, 13);
        for (int k = 0; k < 3; k++) {
            a.mean[k] += b.mean[k];
            a.var[k] += b.var[k];
        }
        same("lamp and sky", i, &a, &sum, 0);
    }
    environment_free(e);
}

/* The light of the sky on one straight fiber, against quadrature over the picture. The picture does not turn with the
 * cloth. */
static void picture_on_a_straight_fiber(void **state)
{
    (void)state;
    static const double param[9] = {
        0.01, 0.02, 0.03, 0.03, 0.02, 0.01, 8 * RAD_PER_DEG, 30 * RAD_PER_DEG, 40 * RAD_PER_DEG};
    const double tile_m = 0.4e-3, radius_m = 5e-6, y_z[1][2] = {{0.13e-3, 0}}, rotation[3] = {0, 0.4, 1.9};
    enum { FINE = 128 };
    struct environment *e = painted_environment(64, 32, paint_sky);
    struct fiber_set f;
    struct scene *scene = NULL;
    hand_straight(&f, 1, y_z, tile_m, radius_m);
    assert_int_equal(scene_new(&f, &(struct scene_option){.black_sheet = true}, &scene, NULL), STATUS_OK);
    for (int r = 0; r < 3; r++) {
        struct configuration c = {.cloth_rotation_rad = rotation[r],
                                  .crop_m = 8 * tile_m,
                                  .light = LIGHT_NO_LAMP,
                                  .camera = CAMERA_FAR_FIELD,
                                  .environment = e};
        double want[3] = {0}, wo[3] = {0, 0, 1};
        for (int i = 0; i < FINE / 2; i++)
            for (int j = 0; j < 2 * FINE; j++) { /* upper half only: the sheet is black */
                double theta = M_PI * (i + 0.5) / FINE, phi = M_PI * (j + 0.5) / FINE, turned = phi - rotation[r];
                double wi[3] = {sin(theta) * cos(turned), sin(theta) * sin(turned), cos(theta)};
                double area = sin(theta) * (M_PI / FINE) * (M_PI / FINE);
                float d[3] = {(float)(sin(theta) * cos(phi)), (float)(sin(theta) * sin(phi)), (float)cos(theta)},
                      rgb[3];
                environment_at(e, d, rgb);
                for (int k = 0; k < 3; k++)
                    want[k] += reference_s(param, wi, wo, k) * hypot(wi[1], wi[2]) * (double)rgb[k] * area;
            }
        struct estimate got = run(scene, "two_lobe.v1", param, &c, 400000, 14);
        for (int k = 0; k < 3; k++) {
            double w = 2 * radius_m / tile_m * want[k], se = sqrt(got.var[k]);
            if (!(fabs(got.mean[k] - w) < 4 * se + 5e-3 * w) || se > 0.05 * w)
                fail_msg("rotation %g, channel %d: %.6g +- %.2g, quadrature %.6g", rotation[r], k, got.mean[k], se, w);
        }
    }
    scene_free(scene);
    fiber_set_release(&f);
    environment_free(e);
}

/* Samples follow the density, the density integrates to 1, and both functions return the same density. */
static void picture_samples_follow_their_density(void **state)
{
    (void)state;
    enum { N = 400000, ROWS = 8, COLUMNS = 12, FINE = 16 };
    static double expected[ROWS * COLUMNS];
    static uint64_t observed[ROWS * COLUMNS];
    struct environment *e = painted_environment(48, 32, paint_sky);
    for (int i = 0; i < ROWS * FINE; i++)
        for (int j = 0; j < COLUMNS * FINE; j++) {
            double theta = M_PI * (i + 0.5) / (ROWS * FINE), phi = 2 * M_PI * (j + 0.5) / (COLUMNS * FINE);
            float d[3] = {(float)(sin(theta) * cos(phi)), (float)(sin(theta) * sin(phi)), (float)cos(theta)}, rgb[3];
            double area =
                (cos(M_PI * i / (ROWS * FINE)) - cos(M_PI * (i + 1) / (ROWS * FINE))) * 2 * M_PI / (COLUMNS * FINE);
            expected[i / FINE * COLUMNS + j / FINE] += (double)environment_at(e, d, rgb) * area;
        }
    double total = 0, chi2 = 0;
    for (int i = 0; i < ROWS * COLUMNS; i++) total += expected[i];
    assert_true(fabs(total - 1) < 1e-5);
    struct rng r;
    rng_start(&r, &(struct rng_key){15, 0, 0, 0}, 0, 0);
    for (int i = 0; i < N; i++) {
        float u[2] = {rng_float(&r), rng_float(&r)}, d[3], rgb[3], again[3], pdf;
        assert_true(environment_sample(e, u, d, rgb, &pdf));
        float pdf_again = environment_at(e, d, again);
        if (i < 20000 && memcmp(rgb, again, sizeof rgb) == 0) assert_true(pdf == pdf_again);
        double phi = atan2((double)d[1], (double)d[0]);
        if (phi < 0) phi += 2 * M_PI;
        int row = (int)(acos((double)d[2]) / M_PI * ROWS), column = (int)(phi / (2 * M_PI) * COLUMNS);
        observed[(row < ROWS ? row : ROWS - 1) * COLUMNS + (column < COLUMNS ? column : COLUMNS - 1)]++;
    }
    for (int i = 0; i < ROWS * COLUMNS; i++) {
        double want = expected[i] * N, off = (double)observed[i] - want;
        assert_true(want > 10);
        chi2 += off * off / want;
    }
    double dof = ROWS * COLUMNS - 1; /* chi-square of many degrees of freedom: normal, 4 standard deviations */
    if (fabs(chi2 - dof) > 4 * sqrt(2 * dof)) fail_msg("chi-square %g for %g degrees of freedom", chi2, dof);
    environment_free(e);
}

static void bad_lights_are_refused(void **state)
{
    (void)state;
    struct configuration c[16];
    struct environment *e = NULL;
    struct image im;
    struct error err = {0};
    struct estimate out;
    const size_t n_path = 256;
    const double white[3] = {1, 1, 1};
    assert_int_equal(image_init(&im, 4, 2, 3, NULL), STATUS_OK);
    assert_int_equal(environment_new(&im, 0, &e, &err), STATUS_INVALID);
    im.pixel[5] = NAN;
    assert_int_equal(environment_new(&im, 1, &e, &err), STATUS_INVALID);
    im.pixel[5] = -1;
    assert_int_equal(environment_new(&im, 1, &e, &err), STATUS_INVALID);
    im.pixel[5] = 0;
    assert_int_equal(environment_new(&im, 1, &e, &err), STATUS_OK);
    assert_int_not_equal(environment_read_exr("/nowhere/sky.exr", 1, &e, &err), STATUS_OK);
    orbit_configurations_16(c);
    struct appearance model;
    struct estimate_request q = {.input = trace_input_surface(weave[0], scattering_find("isotropic.v1"), white, &model),
                                 .configuration = c,
                                 .n_configuration = 1,
                                 .n_path = &n_path};
    c[0].environment = e; /* all black: no light, no NaN */
    c[0].light = LIGHT_NO_LAMP;
    assert_int_equal(estimate_run(&q, NULL, NULL, &out, &err), STATUS_OK);
    assert_true(out.mean[0] == 0 && out.mean[1] == 0 && out.mean[2] == 0);
    c[0].environment_rgb[1] = -1;
    assert_int_equal(estimate_run(&q, NULL, NULL, &out, &err), STATUS_INVALID);
    c[0].environment_rgb[1] = NAN;
    assert_int_equal(estimate_run(&q, NULL, NULL, &out, &err), STATUS_INVALID);
    c[0].environment_rgb[1] = 0;
    c[0].light = (enum configuration_light)7;
    assert_int_equal(estimate_run(&q, NULL, NULL, &out, &err), STATUS_INVALID);
    image_release(&im);
    environment_free(e);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(directional_lamp_closed_form),
        cmocka_unit_test(directional_lamp_is_a_distant_one),
        cmocka_unit_test(far_field_camera_is_a_distant_one),
        cmocka_unit_test(constant_environment_is_a_furnace),
        cmocka_unit_test(constant_picture_is_the_constant_environment),
        cmocka_unit_test(lights_add_up),
        cmocka_unit_test(picture_on_a_straight_fiber),
        cmocka_unit_test(picture_samples_follow_their_density),
        cmocka_unit_test(bad_lights_are_refused),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
