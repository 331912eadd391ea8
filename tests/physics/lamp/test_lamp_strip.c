/* Points of the strip of a lamp that a narrow lobe sees (lamp_strip.h): their density, and radiances and derivatives of
 * paths with them against paths without, which must have the same means. Tolerances are standard errors.
 */
#include "base/angle.h"
#include "renderer/transport/camera.h"
#include "renderer/transport/lamp_strip.h"
#include "renderer/transport/surface/path_tracer.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/statistics_test.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

static const struct configuration view = {.light_theta_rad = 40 * RAD_PER_DEG,
                                          .camera_theta_rad = 35 * RAD_PER_DEG,
                                          .camera_phi_rad = 180 * RAD_PER_DEG,
                                          .light_distance_m = 0.61,
                                          .lamp_side_m = 0.1,
                                          .camera_distance_m = 1,
                                          .crop_m = 0.01};
static const float place_mm[3] = {12, -7, -0.1f};

/* A fiber of a random direction whose lobe of 1 degree has its middle at most 6 degrees off the lamp's. */
static void random_strip(struct rng *r, const struct lamp *lamp, struct lamp_strip *strip)
{
    do {
        float tangent[3], length2 = 0, towards[3], along = 0, distance2 = 0;
        for (int a = 0; a < 3; a++) {
            tangent[a] = 2 * rng_float(r) - 1;
            length2 += tangent[a] * tangent[a];
        }
        for (int a = 0; a < 3; a++) {
            tangent[a] /= sqrtf(length2);
            towards[a] = lamp->centre_mm[a] - place_mm[a];
            distance2 += towards[a] * towards[a];
            along += tangent[a] * towards[a];
        }
        float sin_o = -along / sqrtf(distance2) + 0.2f * (rng_float(r) - 0.5f);
        if (fabsf(sin_o) < 1) lamp_strip_init(strip, lamp, place_mm, tangent, sin_o, (float)RAD_PER_DEG);
    } while (!strip->used);
}

/* Counts samples in squares of the lamp and compares with the integral of the ratio over each. */
static void test_density(void **state)
{
    enum { EDGE = 12, CELL = EDGE * EDGE, FINE = 24, N_STRIP = 20, N = 40000 };
    struct lamp lamp;
    struct rng r;
    (void)state;
    lamp_init(&lamp, &view);
    rng_start(&r, &(struct rng_key){.seed = 5}, 0, 0);
    for (int i_strip = 0; i_strip < N_STRIP; i_strip++) {
        struct lamp_strip strip = {0};
        double count[CELL] = {0}, expected[CELL] = {0}, sum = 0, degree;
        random_strip(&r, &lamp, &strip);
        for (int i = 0; i < CELL * FINE * FINE; i++) {
            const int column = i % (EDGE * FINE), row = i / (EDGE * FINE);
            const float u[2] = {((float)column + 0.5f) / (EDGE * FINE), ((float)row + 0.5f) / (EDGE * FINE)};
            double part = (double)lamp_strip_ratio(&strip, u) / (CELL * FINE * FINE);
            expected[row / FINE * EDGE + column / FINE] += N * part;
            sum += part;
        }
        if (!(fabs(sum - 1) < 0.01)) fail_msg("strip %d: the density has an integral of %.4f", i_strip, sum);
        for (int i = 0; i < N; i++) {
            float u[2] = {rng_float(&r), 0}, of_lamp[2], direction[3], pdf;
            u[1] = rng_float(&r);
            lamp_strip_sample(&strip, u, of_lamp);
            count[(int)(of_lamp[1] * EDGE) * EDGE + (int)(of_lamp[0] * EDGE)]++;
            assert_true(lamp_sample(&lamp, place_mm, of_lamp, direction, &pdf));
            float ratio = lamp_strip_ratio(&strip, of_lamp),
                  again = lamp_strip_ratio_towards(&strip, &lamp, place_mm, direction);
            /* directions are rounded: some 1e-5 of the lamp's half side, which counts near its corners */
            if (ratio < 20) assert_true(fabsf(again - ratio) < 0.02f * ratio + 1e-3f);
        }
        for (int k = 0; k < CELL; k++) expected[k] /= sum;
        double statistic = chi_square_statistic(count, expected, CELL, &degree), p = chi_square_tail(statistic, degree);
        if (p < 1e-5) fail_msg("strip %d: chi-square %.1f with %.0f degrees of freedom", i_strip, statistic, degree);
    }
}

static void test_wide_lobes_have_none(void **state)
{
    struct lamp lamp;
    const float tangent[3] = {1, 0, 0};
    (void)state;
    lamp_init(&lamp, &view);
    float sin_o = -(lamp.centre_mm[0] - place_mm[0]) / 610;
    struct lamp_strip strip;
    lamp_strip_init(&strip, &lamp, place_mm, tangent, sin_o, (float)RAD_PER_DEG);
    assert_true(strip.used);
    lamp_strip_init(&strip, &lamp, place_mm, tangent, sin_o, (float)(6 * RAD_PER_DEG));
    assert_false(strip.used);
    lamp_strip_init(&strip, &lamp, place_mm, tangent, sin_o + 0.2f, (float)RAD_PER_DEG);
    assert_false(strip.used);
    lamp_strip_init(&strip, &lamp, place_mm, tangent, sin_o, 0);
    assert_false(strip.used);
}

enum { P_C_R = 0, P_C_TT = 3, P_BETA_R = 6, N_PARAM = 9, N_FIGURE = 5 };

/* Means of two radiances and three derivatives. */
static void trace(const struct path_setting *s, const struct camera *camera, uint32_t stream,
                  struct sample_mean figure[N_FIGURE])
{
    enum { N = 120000 };
    for (uint32_t i = 0; i < N; i++) {
        struct rng r;
        struct scene_ray ray;
        struct path_result path = {{0}};
        rng_start(&r, &(struct rng_key){.seed = 21 + stream}, 0, i);
        const double xy[2] = {rng_double(&r), rng_double(&r)};
        assert_true(camera_ray(camera, s->scene, xy, &ray));
        path_trace(s, &ray, &r, &path, NULL);
        const float of_path[N_FIGURE] = {path.radiance[0], path.radiance[1], path.jac[P_C_R], path.jac[P_C_TT],
                                         path.jac[P_BETA_R]};
        for (size_t k = 0; k < N_FIGURE; k++) sample_mean_add(&figure[k], (double)of_path[k]);
    }
}

static void test_same_means(void **state)
{
    const struct scattering_model *m = scattering_find("two_lobe.v1");
    const double param[N_PARAM] = {0.7, 0.1, 0.1, 0.6, 0.5, 0.5, RAD_PER_DEG, 10 * RAD_PER_DEG, 20 * RAD_PER_DEG};
    struct scattering_state *fiber;
    struct scene *scene;
    struct fiber_set f;
    struct camera camera;
    (void)state;
    hand_weave_small(&f);
    assert_int_equal(scene_new(&f, &(struct scene_option){.black_sheet = true}, &scene, NULL), STATUS_OK);
    assert_int_equal(scattering_prepare(m, param, NULL, &fiber, NULL), STATUS_OK);
    camera_init(&camera, &view);
    for (uint32_t n_traced = 0; n_traced < 3; n_traced++) {
        struct path_setting s;
        struct sample_mean figure[2][N_FIGURE] = {{{0}}};
        path_setting_init(&s, scene, m, fiber, &view, n_traced == 0);
        assert_true(s.has_strips);
        s.n_traced = n_traced;
        for (uint32_t i = 0; i < 2; i++) {
            s.has_strips = i == 1;
            trace(&s, &camera, 2 * n_traced + i, figure[i]);
        }
        for (size_t k = 0; k < (n_traced == 0 ? N_FIGURE : 2); k++) {
            double se[2] = {sample_mean_se(&figure[0][k]), sample_mean_se(&figure[1][k])};
            print_message("%u traced, figure %zu: %.4f +- %.4f without, %.4f +- %.4f with strips\n", n_traced, k,
                          figure[0][k].mean, se[0], figure[1][k].mean, se[1]);
            assert_true(fabs(figure[0][k].mean - figure[1][k].mean) < 4 * hypot(se[0], se[1]));
        }
        /* red comes by the narrow lobe */
        assert_true(figure[1][0].m2 < 0.7 * figure[0][0].m2);
    }
    m->release(fiber);
    scene_free(scene);
    fiber_set_release(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_density), cmocka_unit_test(test_wide_lobes_have_none),
                                       cmocka_unit_test(test_same_means)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
