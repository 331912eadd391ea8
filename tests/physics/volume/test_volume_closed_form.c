/* The volume tracer against closed forms of a homogeneous slab (transmittance, single scattering, their derivatives by
 * d and gamma), the white furnace, and the surface tracer on a dilute cloud of fibers. Every tolerance is a number of
 * standard errors, with what a limit leaves out stated beside it.
 */
#include "base/angle.h"
#include "renderer/estimate/estimate.h"
#include "renderer/transport/camera.h"
#include "renderer/transport/volume/volume_tracer.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/scan/hand_volume.h"
#include "tests/support/statistics_test.h"
#include "tests/support/tracer/reference_two_lobe.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { N_VALUE = 3 + VOLUME_N_DERIVATIVE };

static void start_param(const struct phase_model *m, double *param)
{
    for (size_t p = 0; p < m->n_param; p++) param[p] = m->param[p].start;
}

static void prepare(const struct phase_model *m, const double *param, struct phase_state **s)
{
    struct error err = {0};
    if (m->prepare(param, s, &err) != STATUS_OK) fail_msg("%s", err.text);
}

static void scene_of(struct volume_scene *scene, const struct direction_volume *v, bool black_sheet)
{
    assert_int_equal(volume_scene_init(scene, v, &(struct volume_scene_option){black_sheet}, NULL), STATUS_OK);
}

/* Means over paths that enter from above along `direction`. */
static void trace(const struct volume_setting *s, const double direction[3], size_t n_path, uint32_t stream,
                  struct sample_mean value[N_VALUE])
{
    const struct rng_key key = {51, 0, 0, stream};
    memset(value, 0, N_VALUE * sizeof *value);
    for (size_t i = 0; i < n_path; i++) {
        struct rng rng;
        struct volume_ray ray;
        struct volume_result path;
        rng_start(&rng, &key, 0, (uint32_t)i);
        double origin[3] = {rng_double(&rng), rng_double(&rng), 1};
        assert_true(volume_ray_enter(s->scene, origin, direction, &ray));
        volume_trace(s, &ray, &rng, &path, NULL);
        for (int k = 0; k < 3; k++) sample_mean_add(&value[k], (double)path.radiance[k]);
        for (size_t k = 0; k < 3 * (s->model->n_param + 1); k++) sample_mean_add(&value[3 + k], (double)path.jac[k]);
    }
}

static void check(const char *what, const struct sample_mean *got, double want, double left_out)
{
    double se = sample_mean_se(got);
    if (!(fabs(got->mean - want) <= 3.5 * se + left_out))
        fail_msg("%s: %.6g +- %.2g, closed form %.6g", what, got->mean, se, want);
}

/* Transmittance in a uniform environment, by flakes and fibers that scatter almost nothing. */
static void transmittance(void **state)
{
    (void)state;
    const size_t n[3] = {5, 6, 7};
    const double angle = 25 * RAD_PER_DEG, voxel_m = 10e-6, d_per_m = 12000, rho = 200.0 / 255;
    const double direction[3] = {sin(angle), 0, -cos(angle)}, length_m = 7 * voxel_m / cos(angle);
    const float along[3] = {0.6f, 0, 0.8f};
    const double sine = sqrt(1 - pow(0.6 * direction[0] + 0.8 * direction[2], 2));
    struct direction_volume v;
    struct volume_scene scene;
    hand_volume_uniform(&v, n, voxel_m, 200, along);
    scene_of(&scene, &v, false);
    for (size_t k = 0; phase_registry()[k] != NULL; k++) {
        const struct phase_model *m = phase_registry()[k];
        struct phase_state *s;
        struct volume_setting setting;
        struct sample_mean value[N_VALUE];
        double param[SCATTERING_MAX_PARAM];
        start_param(m, param);
        int alpha = (int)(m->n_param == 12 ? 9 : 0);
        for (int c = 0; c < 3; c++) param[alpha + c] = 0.001;
        prepare(m, param, &s);
        const struct volume_parameters parameters = {m, s, d_per_m};
        volume_setting_init(&setting, &scene, &parameters, NULL, true);
        setting.lights.has_constant = true;
        for (int c = 0; c < 3; c++) setting.lights.constant[c] = 1;
        setting.roulette_below = 0.001f;
        trace(&setting, direction, 100000, (uint32_t)k, value);
        float d_s, s_w = phase_extinction_at(setting.extinction, (float)sine, &d_s);
        if (m->n_param == 12) assert_true(fabs((double)s_w - sine) < 1e-6);
        double tau = d_per_m * rho * (double)s_w * length_m, t = exp(-tau);
        /* scattered light is at most alpha (1 - T) (furnace), its derivatives are of that order too */
        check("transmittance", &value[0], t, 0.001 * (1 - t));
        check("by d", &value[3 + m->n_param], -tau / d_per_m * t, 0.002 * tau / d_per_m);
        if (setting.extinction->i_param >= 0)
            check("by gamma", &value[3 + setting.extinction->i_param], -tau * (double)(d_s / s_w) * t,
                  0.004 * tau * fabs((double)(d_s / s_w)));
        m->release(s);
    }
    volume_scene_release(&scene);
    direction_volume_release(&v);
}

/* Light from a distant lamp, scattered once by a slab that scatters equally everywhere:
 *     alpha / 4 * m_i / (m_i + m_o) * (1 - exp(-tau A)),  A = 1 / m_i + 1 / m_o   (irradiance pi facing the lamp) */
static void single_scattering(void **state)
{
    (void)state;
    const size_t n[3] = {4, 4, 5};
    const double voxel_m = 10e-6, d_per_m = 16000, tau = 5 * voxel_m * d_per_m, alpha = 0.002;
    const float along[3] = {1, 0, 0};
    const struct phase_model *m = phase_find("phase_isotropic.v1");
    struct direction_volume v;
    struct volume_scene scene;
    struct phase_state *s;
    hand_volume_uniform(&v, n, voxel_m, 255, along);
    scene_of(&scene, &v, true);
    prepare(m, (double[3]){alpha, alpha, alpha}, &s);
    const double angle_deg[3][2] = {{0, 40}, {60, 30}, {75, 80}};
    for (uint32_t a = 0; a < 3; a++) {
        double theta_o = angle_deg[a][0] * RAD_PER_DEG, theta_i = angle_deg[a][1] * RAD_PER_DEG;
        const struct configuration c = {.light_theta_rad = theta_i,
                                        .light_phi_rad = 0.7,
                                        .light_distance_m = 200,
                                        .lamp_side_m = 1,
                                        .camera_distance_m = 1,
                                        .crop_m = 0.01};
        struct volume_setting setting;
        struct sample_mean value[N_VALUE];
        const struct volume_parameters parameters = {m, s, d_per_m};
        volume_setting_init(&setting, &scene, &parameters, &c, true);
        setting.roulette_below = 0.001f;
        setting.shadow_below = 0;
        const double direction[3] = {-sin(theta_o), 0, -cos(theta_o)};
        trace(&setting, direction, 100000, 10 + a, value);
        double mi = cos(theta_i), mo = cos(theta_o), sum = 1 / mi + 1 / mo, head = alpha / 4 * mi / (mi + mo);
        double once = head * -expm1(-tau * sum), by_d = head * tau / d_per_m * sum * exp(-tau * sum);
        check("single scattering", &value[0], once,
              alpha * once); /* light scattered twice is less than alpha times this */
        check("by d", &value[3 + 3], by_d, alpha * (by_d + once / d_per_m));
        check("by alpha", &value[3 + 0], once / alpha, 2 * once);
        assert_true(sample_mean_se(&value[0]) < 0.01 * once);
    }
    m->release(s);
    volume_scene_release(&scene);
    direction_volume_release(&v);
}

/* A slab that absorbs nothing has the radiance of the environment everywhere. The bound of albedos is 0.999, so the
 * result is extrapolated to 1 by its derivative. The remainder is (1 - alpha)^2 times half the second derivative,
 * which is at most n^2 for n scatterings. */
static void white_furnace(void **state)
{
    (void)state;
    const size_t n[3] = {24, 24, 10};
    const double angle = 50 * RAD_PER_DEG, direction[3] = {0, sin(angle), -cos(angle)};
    struct direction_volume v;
    struct volume_scene scene;
    hand_volume_weave(&v, n, 5e-6, 0.4);
    scene_of(&scene, &v, false);
    for (size_t k = 0; phase_registry()[k] != NULL; k++) {
        const struct phase_model *m = phase_registry()[k];
        struct phase_state *s;
        struct volume_setting setting;
        struct sample_mean value[N_VALUE];
        double param[SCATTERING_MAX_PARAM];
        start_param(m, param);
        size_t alpha = m->n_param == 12 ? 9 : 0;
        for (size_t c = 0; c < 3; c++) param[alpha + c] = m->param[alpha].upper;
        prepare(m, param, &s);
        const struct volume_parameters parameters = {m, s, 8e4};
        volume_setting_init(&setting, &scene, &parameters, NULL, true);
        setting.lights.has_constant = true;
        for (int c = 0; c < 3; c++) setting.lights.constant[c] = 1;
        trace(&setting, direction, 30000, 20 + (uint32_t)k, value);
        for (size_t c = 0; c < 3; c++) {
            double missing = 1 - param[alpha + c];
            struct sample_mean white = value[c];
            white.mean += missing * value[3 + c * (m->n_param + 1) + alpha + c].mean;
            check(m->id, &white, 1, missing * missing * 400);
            if (sample_mean_se(&value[c]) > 0.01) fail_msg("%s is too noisy for this test", m->id);
        }
        m->release(s);
    }
    volume_scene_release(&scene);
    direction_volume_release(&v);
}

/* Rays along the fibers, exactly and within rounding, from random points of the slab. */
static void along_the_fiber(void **state)
{
    (void)state;
    const size_t n[3] = {6, 6, 6};
    const float along[3] = {1, 0, 0};
    struct direction_volume v;
    struct volume_scene scene;
    hand_volume_uniform(&v, n, 10e-6, 255, along);
    scene_of(&scene, &v, true);
    const struct configuration c = {.light_theta_rad = 80 * RAD_PER_DEG,
                                    .light_distance_m = 0.61,
                                    .lamp_side_m = 0.1,
                                    .camera_distance_m = 1,
                                    .crop_m = 0.01};
    const float way[4][3] = {{1, 0, 0}, {-1, 0, 0}, {1, 1e-4f, -1e-4f}, {-1, 0, 3e-7f}};
    for (size_t k = 0; phase_registry()[k] != NULL; k++) {
        const struct phase_model *m = phase_registry()[k];
        struct phase_state *s;
        struct volume_setting setting;
        double param[SCATTERING_MAX_PARAM];
        start_param(m, param);
        prepare(m, param, &s);
        const struct volume_parameters parameters = {m, s, 4e4};
        volume_setting_init(&setting, &scene, &parameters, &c, true);
        for (uint32_t i = 0; i < 200; i++) {
            struct rng rng;
            struct volume_result path;
            struct volume_ray ray = {.at = {1.5f, 2.5f, 3.5f}};
            rng_start(&rng, &(struct rng_key){52, 0, 0, 0}, (uint32_t)k, i);
            volume_ray_turn(&scene, way[i % 4], &ray);
            volume_trace(&setting, &ray, &rng, &path, NULL);
            for (int x = 0; x < 3; x++) assert_true(isfinite(path.radiance[x]));
            for (size_t x = 0; x < 3 * (m->n_param + 1); x++) assert_true(isfinite(path.jac[x]));
        }
        m->release(s);
    }
    volume_scene_release(&scene);
    direction_volume_release(&v);
}

/* A random cloud of straight fibers, estimated as cylinders and as a volume of one coarse voxel. */
enum { N_CLOUD = 128, N_FIBER = 16 };
static const double cloud_tile_m = 5e-3, cloud_radius_m = 5e-6, cloud_scale = 5000;

static void estimate_cloud(uint32_t i_cloud, const double *param, const struct configuration c[2], size_t n_path,
                           struct thread_pool *pool, struct estimate surface[2], struct estimate volume[2])
{
    const size_t n[3] = {1, 1, 1}, count[2] = {n_path, n_path};
    double at[N_FIBER][2];
    struct rng r;
    rng_start(&r, &(struct rng_key){53, 0, 0, 0}, i_cloud, 0);
    for (int i = 0; i < N_FIBER; i++) {
        at[i][0] = cloud_tile_m * rng_double(&r);
        at[i][1] = cloud_tile_m * rng_double(&r);
    }
    struct fiber_set f;
    struct scene *scene = NULL;
    struct direction_volume v;
    struct volume_scene coarse;
    struct error err = {0};
    hand_straight(&f, N_FIBER, (const double(*)[2])at, cloud_tile_m, cloud_radius_m);
    hand_volume_rasterise(&v, n, cloud_tile_m / (double)n[0], &f, cloud_scale);
    scene_of(&coarse, &v, true);
    assert_int_equal(scene_new(&f, &(struct scene_option){.black_sheet = true}, &scene, NULL), STATUS_OK);
    struct appearance model;
    const struct estimate_request q = {.input =
                                           trace_input_surface(scene, scattering_find("two_lobe.v1"), param, &model),
                                       .configuration = c,
                                       .n_configuration = 2,
                                       .n_path = count,
                                       .seed = i_cloud};
    struct trace_volume volume_qv;
    const struct estimate_request qv = {.input =
                                            trace_input_volume(&coarse, phase_find("phase_two_lobe.v1"), param,
                                                               2 / (M_PI * cloud_radius_m) / cloud_scale, &volume_qv),
                                        .configuration = c,
                                        .n_configuration = 2,
                                        .n_path = count,
                                        .seed = i_cloud};
    if (estimate_run(&q, pool, NULL, surface, &err) != STATUS_OK) fail_msg("%s", err.text);
    if (estimate_run(&qv, pool, NULL, volume, &err) != STATUS_OK) fail_msg("%s", err.text);
    scene_free(scene);
    fiber_set_release(&f);
    volume_scene_release(&coarse);
    direction_volume_release(&v);
}

/* Thin fibers far apart, seen and lit in the plane across the fibers. A fiber of radius r is 2 r wide and its section
 * is pi r^2, so full density corresponds to d = 2 / (pi r) per metre; its albedo towards wo is the integral of S cos
 * th_i. In a cloud some fibers are shadowed and others are not, while the volume has the mean shadow. The comparison
 * is therefore over many clouds, and its standard error is that of the differences between clouds, with Monte-Carlo
 * noise. Light scattered twice is of the order of the optical depth, 0.032, in both. Two known differences remain: in
 * the volume a fiber shadows itself (1 / N of a shadow of half the depth both ways, 0.25 %), and its density is
 * rounded to a byte (0.15 %). Fibers that are much thinner than the tile cannot be traced as cylinders in single
 * precision. */
static void agrees_with_the_surface_tracer(void **state)
{
    (void)state;
    struct thread_pool *pool = NULL;
    struct sample_mean difference[2][3], surface[2][3];
    struct configuration c[2];
    memset(difference, 0, sizeof difference);
    memset(surface, 0, sizeof surface);
    for (int i = 0; i < 2; i++)
        c[i] = (struct configuration){.light_theta_rad = (i ? 60 : 20) * RAD_PER_DEG,
                                      .light_phi_rad = M_PI_2,
                                      .camera_theta_rad = 35 * RAD_PER_DEG,
                                      .camera_phi_rad = i ? -M_PI_2 : M_PI_2,
                                      .light_distance_m = 0.61,
                                      .lamp_side_m = 0.1,
                                      .camera_distance_m = 1,
                                      .crop_m = cloud_tile_m * cos(35 * RAD_PER_DEG)}; /* a whole tile on the cloth */
    double param[12] = {0.3, 0.05, 0.1, 0.6, 0.3, 0.1, 8 * RAD_PER_DEG, 15 * RAD_PER_DEG, 40 * RAD_PER_DEG};
    for (int k = 0; k < 3; k++) param[9 + k] = reference_camera_furnace(param, 0, k);
    assert_int_equal(thread_pool_new(0, &pool, NULL), STATUS_OK);
    for (uint32_t i_cloud = 0; i_cloud < N_CLOUD; i_cloud++) {
        struct estimate e[2][2];
        estimate_cloud(i_cloud, param, c, 20480, pool, e[0], e[1]);
        for (int i = 0; i < 2; i++)
            for (int k = 0; k < 3; k++) {
                sample_mean_add(&surface[i][k], e[0][i].mean[k]);
                sample_mean_add(&difference[i][k], e[1][i].mean[k] - e[0][i].mean[k]);
            }
    }
    thread_pool_free(pool);
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 3; k++) {
            double mean = surface[i][k].mean, off = difference[i][k].mean / mean,
                   se = sample_mean_se(&difference[i][k]) / mean;
            print_message("configuration %d, channel %d: volume differs by %.4f +- %.4f\n", i, k, off, se);
            if (!(fabs(off) <= 3 * se + 0.004)) fail_msg("surface and volume disagree");
            assert_true(se < 0.01);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(transmittance),
        cmocka_unit_test(single_scattering),
        cmocka_unit_test(white_furnace),
        cmocka_unit_test(along_the_fiber),
        cmocka_unit_test(agrees_with_the_surface_tracer),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
