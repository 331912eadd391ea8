/* Lights and cameras of volumes. The directional lamp and the picture environment are compared with closed forms and
 * quadrature of single scattering in a slab that scatters isotropically, from above and from below. Distant lamps and
 * cameras are compared with their limits, and constant pictures with constant environments; lights must be additive.
 * Tolerances are standard errors plus the stated remainders of closed forms. */
#include "base/angle.h"
#include "renderer/estimate/estimate.h"
#include "renderer/transport/environment.h"
#include "renderer/transport/volume/volume_scene.h"
#include "tests/support/scan/hand_volume.h"
#include "tests/support/tracer/environment/painted_environment.h"
#include "tests/support/tracer/orbit_configurations.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static struct direction_volume slab, weave;
static struct volume_scene thin[2], woven[2]; /* without and with the black sheet */
static const double slab_m = 50e-6, d_per_m = 16000, alpha = 0.002;

static int set_up(void **state)
{
    (void)state;
    const size_t n[3] = {4, 4, 5}, n_weave[3] = {26, 30, 11};
    const float along[3] = {0, 1, 0};
    hand_volume_uniform(&slab, n, slab_m / 5, 255, along);
    hand_volume_weave(&weave, n_weave, 10e-6, 0.5);
    for (int b = 0; b < 2; b++) {
        const struct volume_scene_option option = {.black_sheet = b == 1};
        if (volume_scene_init(&thin[b], &slab, &option, NULL) != STATUS_OK) return 1;
        if (volume_scene_init(&woven[b], &weave, &option, NULL) != STATUS_OK) return 1;
    }
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    for (int b = 0; b < 2; b++) {
        volume_scene_release(&thin[b]);
        volume_scene_release(&woven[b]);
    }
    direction_volume_release(&slab);
    direction_volume_release(&weave);
    return 0;
}

static struct estimate run(const struct volume_scene *scene, const char *model, const double *param,
                           const struct configuration *c, size_t n_path, uint64_t seed)
{
    struct estimate e;
    struct error err = {0};
    struct trace_volume volume_model;
    struct estimate_request q = {
        .input = trace_input_volume(scene, phase_find(model), param, scene->n[2] == 5 ? d_per_m : 3e4, &volume_model),
        .configuration = c,
        .n_configuration = 1,
        .n_path = &n_path,
        .seed = seed};
    q.input.want_derivative = true;
    if (estimate_run(&q, NULL, NULL, &e, &err) != STATUS_OK) fail_msg("%s", err.text);
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

/* Single scattering of parallel light (irradiance pi on a plane that faces it) towards a camera at cosine mo: alpha / 4
 * times the integral over depth of exp(-way in - way out) sigma / mo. mi < 0 is light from below. *d_tau becomes the
 * derivative by the optical depth. */
static double scattered_once(double tau, double mi, double mo, double *d_tau)
{
    enum { N = 4000 };
    double sum = 0, d = 0;
    for (int i = 0; i < N; i++) {
        double z = (i + 0.5) / N, way = (mi > 0 ? z / mi : (1 - z) / -mi) + z / mo, f = exp(-tau * way) / mo / N;
        sum += tau * f;
        d += (1 - tau * way) * f;
    }
    *d_tau = alpha / 4 * d;
    return alpha / 4 * sum;
}

static void directional_lamp_closed_form(void **state)
{
    (void)state;
    const double param[3] = {alpha, alpha, alpha}, tau = slab_m * d_per_m;
    const double angle_deg[5][2] = {{0, 40}, {60, 30}, {75, 80}, {20, 150}, {60, 105}}; /* camera, lamp */
    for (int i = 0; i < 5; i++) {
        const struct configuration c = {.light_theta_rad = angle_deg[i][1] * RAD_PER_DEG,
                                        .light_phi_rad = 0.7,
                                        .camera_theta_rad = angle_deg[i][0] * RAD_PER_DEG,
                                        .crop_m = 0.01,
                                        .light = LIGHT_DIRECTIONAL,
                                        .camera = CAMERA_FAR_FIELD};
        double by_tau, want = scattered_once(tau, cos(c.light_theta_rad), cos(c.camera_theta_rad), &by_tau);
        struct estimate e = run(&thin[0], "phase_isotropic.v1", param, &c, 1000000, 3);
        double se = sqrt(e.var[0]), by_d = by_tau * slab_m, se_d = sqrt(e.jac_var[3]);
        if (!(fabs(e.mean[0] - want) < 3.5 * se + alpha * want) || se > 0.02 * want)
            fail_msg("view %d: %.6g +- %.2g, closed form %.6g", i, e.mean[0], se, want);
        if (!(fabs(e.jac[3] - by_d) < 3.5 * se_d + alpha * (fabs(by_d) + want / d_per_m)))
            fail_msg("view %d, by d: %.6g +- %.2g, closed form %.6g", i, e.jac[3], se_d, by_d);
        if (c.light_theta_rad > M_PI_2) { /* with the black sheet, no light arrives from below */
            e = run(&thin[1], "phase_isotropic.v1", param, &c, 2560, 3);
            assert_true(e.mean[0] == 0);
        }
    }
}

static void coloured(double param[12])
{
    static const double p[12] = {0.2, 0.1, 0.3, 0.8, 0.6, 0.4, 6 * RAD_PER_DEG, 18 * RAD_PER_DEG, 25 * RAD_PER_DEG,
                                 0.9, 0.8, 0.6};
    memcpy(param, p, sizeof p);
}

static void distant_lamps_and_cameras(void **state)
{
    (void)state;
    struct configuration c[16];
    double param[12];
    orbit_configurations_16(c);
    coloured(param);
    for (int i = 0; i < 16; i += 5) {
        struct configuration far = c[i];
        far.light_distance_m = 30;
        far.lamp_side_m = 0.3;
        struct estimate a = run(&woven[1], "phase_two_lobe.v1", param, &far, 200000, 4);
        far.light = LIGHT_DIRECTIONAL;
        struct estimate b = run(&woven[1], "phase_two_lobe.v1", param, &far, 200000, 5);
        same("directional and distant lamp", i, &a, &b, 2e-3);
        c[i].camera_distance_m = 100;
        a = run(&woven[1], "phase_two_lobe.v1", param, &c[i], 200000, 6);
        c[i].camera = CAMERA_FAR_FIELD;
        c[i].camera_distance_m = 0;
        b = run(&woven[1], "phase_two_lobe.v1", param, &c[i], 200000, 7);
        same("far-field camera and distant camera", i, &a, &b, 2e-3);
    }
}

/* The sky with a lamp below the horizon. */
static void paint_sky_and_lamp(double theta, double phi, float rgb[3])
{
    paint_sky(theta, phi, rgb);
    if (fabs(theta - 2.5) < 0.2 && fabs(phi - 2) < 0.4) rgb[1] += 15.0f;
}

static void constant_picture_is_the_constant_environment(void **state)
{
    (void)state;
    struct configuration c[16];
    struct environment *e = painted_environment(64, 32, paint_constant);
    double param[12];
    orbit_configurations_16(c);
    coloured(param);
    for (int i = 0; i < 16; i += 5) {
        struct configuration k = c[i];
        k.light = LIGHT_NO_LAMP;
        k.environment_rgb[0] = 0.7;
        k.environment_rgb[1] = 1;
        k.environment_rgb[2] = 1.3;
        struct estimate a = run(&woven[i % 2], "phase_two_lobe.v1", param, &k, 60000, 9);
        memset(k.environment_rgb, 0, sizeof k.environment_rgb);
        k.environment = e;
        struct estimate b = run(&woven[i % 2], "phase_two_lobe.v1", param, &k, 60000, 10);
        same("constant environment and constant picture", i, &a, &b, 0);
    }
    environment_free(e);
}

/* Light of the picture that the thin slab scatters once, against quadrature over the picture, which does not turn
 * with the cloth. Without the sheet the picture is also visible through the slab. */
static void picture_on_the_slab(void **state)
{
    (void)state;
    enum { FINE = 128 };
    const double param[3] = {alpha, alpha, alpha}, tau = slab_m * d_per_m;
    struct environment *e = painted_environment(64, 32, paint_sky_and_lamp);
    for (int i = 0; i < 4; i++) {
        bool sheet = i % 2;
        const struct configuration c = {.cloth_rotation_rad = 0.9 * i,
                                        .crop_m = 0.01,
                                        .light = LIGHT_NO_LAMP,
                                        .camera_theta_rad = 35 * RAD_PER_DEG,
                                        .camera_phi_rad = 0.5,
                                        .camera = CAMERA_FAR_FIELD,
                                        .environment = e};
        double want[3] = {0}, mo = cos(c.camera_theta_rad);
        const float through[3] = {(float)(-sin(35 * RAD_PER_DEG) * cos(0.5)),
                                  (float)(-sin(35 * RAD_PER_DEG) * sin(0.5)), (float)-mo};
        float rgb[3];
        for (int row = 0; row < (sheet ? FINE / 2 : FINE); row++)
            for (int column = 0; column < 2 * FINE; column++) {
                double theta = M_PI * (row + 0.5) / FINE, phi = M_PI * (column + 0.5) / FINE, unused;
                double area = sin(theta) * (M_PI / FINE) * (M_PI / FINE), mi = cos(theta), sum = 1 / mi + 1 / mo;
                const float d[3] = {(float)(sin(theta) * cos(phi)), (float)(sin(theta) * sin(phi)), (float)mi};
                environment_at(e, d, rgb);
                double once = mi > 0        ? alpha / 4 * mi / (mi + mo) * -expm1(-tau * sum)
                              : column == 0 ? scattered_once(tau, mi, mo, &unused)
                                            : 0;
                static double row_value;
                if (mi < 0 && column == 0) row_value = once;
                for (int k = 0; k < 3; k++) want[k] += (mi > 0 ? once : row_value) / M_PI * (double)rgb[k] * area;
            }
        environment_at(e, through, rgb);
        double seen = sheet ? 0 : exp(-tau / mo);
        struct estimate got = run(&thin[sheet], "phase_isotropic.v1", param, &c, 1000000, 14);
        for (int k = 0; k < 3; k++) {
            double w = want[k] + seen * (double)rgb[k], se = sqrt(got.var[k]);
            if (!(fabs(got.mean[k] - w) < 4 * se + 5e-3 * want[k]) || se > 0.05 * w)
                fail_msg("case %d, channel %d: %.6g +- %.2g, quadrature %.6g", i, k, got.mean[k], se, w);
        }
    }
    environment_free(e);
}

/* The radiance of lamp and sky together, and its derivatives, are the sums of those of each. */
static void lights_add_up(void **state)
{
    (void)state;
    struct configuration c[16];
    struct environment *e = painted_environment(64, 32, paint_sky_and_lamp);
    double param[12];
    orbit_configurations_16(c);
    coloured(param);
    for (int i = 1; i < 16; i += 5) {
        struct configuration lamp = c[i], sky = c[i], both = c[i];
        sky.light = LIGHT_NO_LAMP;
        sky.environment = both.environment = e;
        struct estimate a = run(&woven[0], "phase_two_lobe.v1", param, &lamp, 80000, 11);
        struct estimate b = run(&woven[0], "phase_two_lobe.v1", param, &sky, 80000, 12);
        struct estimate sum = run(&woven[0], "phase_two_lobe.v1", param, &both, 80000, 13);
        for (int k = 0; k < 3; k++) {
            a.mean[k] += b.mean[k];
            a.var[k] += b.var[k];
        }
        for (int k = 0; k < 39; k++) {
            double se = sqrt(a.jac_var[k] + b.jac_var[k] + sum.jac_var[k]);
            if (fabs(a.jac[k] + b.jac[k] - sum.jac[k]) > 4.5 * se) fail_msg("configuration %d, derivative %d", i, k);
        }
        same("lamp and sky", i, &a, &sum, 0);
    }
    environment_free(e);
}

/* A slab of many layers that no light passes. Steps as short as the rounding error of the height must not move camera
 * rays out of the slab through the face where they entered. If rays started on the face itself, 1 in 200 would leave
 * at 80 degrees. */
static void no_ray_leaves_where_it_enters(void **state)
{
    (void)state;
    const size_t n[3] = {4, 4, 500}, n_path = 400000;
    const float along[3] = {0, 1, 0};
    const double dark[3] = {0.001, 0.001, 0.001};
    struct direction_volume thick;
    struct volume_scene scene;
    const struct configuration c = {.light = LIGHT_NO_LAMP,
                                    .camera_theta_rad = 80 * RAD_PER_DEG,
                                    .camera_distance_m = 1,
                                    .crop_m = 1e-3,
                                    .environment_rgb = {1, 1, 1}};
    struct estimate e;
    struct error err = {0};
    hand_volume_uniform(&thick, n, 5e-6, 255, along);
    if (volume_scene_init(&scene, &thick, &(struct volume_scene_option){.black_sheet = false}, &err) != STATUS_OK)
        fail_msg("%s", err.text);
    struct trace_volume volume_model;
    const struct estimate_request q = {
        .input = trace_input_volume(&scene, phase_find("phase_isotropic.v1"), dark, 1e7, &volume_model),
        .configuration = &c,
        .n_configuration = 1,
        .n_path = &n_path,
        .seed = 7};
    if (estimate_run(&q, NULL, NULL, &e, &err) != STATUS_OK) fail_msg("%s", err.text);
    if (!(e.mean[0] <= 1.01 * dark[0] + 4 * sqrt(e.var[0])) || !(sqrt(e.var[0]) < 0.1 * dark[0]))
        fail_msg("mean radiance %g +- %g of a slab with albedo %g", e.mean[0], sqrt(e.var[0]), dark[0]);
    volume_scene_release(&scene);
    direction_volume_release(&thick);
}

/* A path that reaches the limit of look-ups inside the cloth has no light from beyond it. A column of full voxels and a
 * large multiplier make the steps so short that no ray through the empty voxels beside it passes the cloth within that
 * limit. */
static void a_lost_path_has_no_light(void **state)
{
    (void)state;
    enum { EDGE = VOLUME_BRICK_EDGE };
    const size_t n[3] = {EDGE, EDGE, 8}, n_path = 64;
    const float along[3] = {0, 1, 0};
    const double grey[3] = {0.5, 0.5, 0.5};
    struct direction_volume one;
    struct volume_scene scene;
    struct configuration c = {
        .light = LIGHT_NO_LAMP, .camera_distance_m = 1, .crop_m = EDGE * 100e-6, .environment_rgb = {1, 1, 1}};
    struct estimate e;
    struct error err = {0};
    hand_volume_uniform(&one, n, 100e-6, 0, along);
    for (size_t z = 0; z < n[2]; z++) one.density[z * EDGE * EDGE] = 255;
    if (volume_scene_init(&scene, &one, &(struct volume_scene_option){.black_sheet = false}, &err) != STATUS_OK)
        fail_msg("%s", err.text);
    for (int k = 0; k < 2; k++) { /* with a mean step of 8e-6 m all rays pass the 0.8 mm, with 8e-10 m none */
        struct trace_volume volume_model;
        const struct estimate_request q = {.input = trace_input_volume(&scene, phase_find("phase_isotropic.v1"), grey,
                                                                       k == 0 ? 1e5 : 1e9, &volume_model),
                                           .configuration = &c,
                                           .n_configuration = 1,
                                           .n_path = &n_path,
                                           .seed = 1};
        if (estimate_run(&q, NULL, NULL, &e, &err) != STATUS_OK) fail_msg("%s", err.text);
        if (k == 0 ? !(e.mean[0] > 0.9) : !(e.mean[0] < 0.1)) fail_msg("mean radiance %g in front of 1", e.mean[0]);
    }
    volume_scene_release(&scene);
    direction_volume_release(&one);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(directional_lamp_closed_form),
        cmocka_unit_test(distant_lamps_and_cameras),
        cmocka_unit_test(constant_picture_is_the_constant_environment),
        cmocka_unit_test(picture_on_the_slab),
        cmocka_unit_test(lights_add_up),
        cmocka_unit_test(a_lost_path_has_no_light),
        cmocka_unit_test(no_ray_leaves_where_it_enters),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
