/* Light that straight parallel fibers scatter once, against quadrature over the lamp. The fibers are so dark that a
 * second scattering is negligible, and so far apart that they neither shadow nor light each other.
 */
#include "base/angle.h"
#include "renderer/estimate/estimate.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/tracer/reference_two_lobe.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const double tile_m = 0.4e-3, radius_m = 5e-6;

static void unit(double theta, double phi, double d[3])
{
    d[0] = sin(theta) * cos(phi);
    d[1] = sin(theta) * sin(phi);
    d[2] = cos(theta);
}

/* World direction to fiber frame: fibers along x of the cloth, which is turned by `rotation`. */
static void to_fiber(const double d[3], double rotation, double out[3])
{
    out[0] = cos(rotation) * d[0] + sin(rotation) * d[1];
    out[1] = -sin(rotation) * d[0] + cos(rotation) * d[1];
    out[2] = d[2];
}

/* Radiance of a fiber: integral over the lamp's square of S cos th_i L, the lamp's radiance by its own definition. */
static double single_scattering(const struct configuration *c, const double param[9], int channel)
{
    enum { N = 48 };
    double centre[3], view[3], wo[3], sum = 0, irradiance = 0, e0[3], e1[3];
    unit(c->light_theta_rad, c->light_phi_rad, centre);
    unit(c->camera_theta_rad, c->camera_phi_rad, view);
    to_fiber(view, c->cloth_rotation_rad, wo);
    e0[0] = -sin(c->light_phi_rad);
    e0[1] = cos(c->light_phi_rad);
    e0[2] = 0;
    unit(c->light_theta_rad + M_PI_2, c->light_phi_rad, e1);
    for (int i = 0; i < N * N; i++) {
        double a = ((i % N + 0.5) / N - 0.5) * c->lamp_side_m, b = ((i / N + 0.5) / N - 0.5) * c->lamp_side_m, p[3],
               r2 = 0, wi[3];
        for (int k = 0; k < 3; k++) {
            p[k] = c->light_distance_m * centre[k] + a * e0[k] + b * e1[k];
            r2 += p[k] * p[k];
        }
        double cos_lamp = 0;
        for (int k = 0; k < 3; k++) {
            p[k] /= sqrt(r2);
            cos_lamp += p[k] * centre[k];
        }
        double solid_angle = cos_lamp / r2 * c->lamp_side_m * c->lamp_side_m / (N * N);
        to_fiber(p, c->cloth_rotation_rad, wi);
        sum += reference_s(param, wi, wo, channel) * hypot(wi[1], wi[2]) * solid_angle;
        irradiance += cos_lamp * solid_angle;
    }
    return sum * M_PI / irradiance;
}

/* Mean deviation over all comparisons. A lamp of the wrong size or a superfluous cosine would change it. */
struct joint {
    double sum, weight;
};

static void check(const struct configuration *c, const double param[9], struct thread_pool *pool,
                  const struct scene *scene, struct joint *joint)
{
    const size_t n_path = 200000;
    struct estimate e;
    struct error err = {0};
    struct appearance model;
    struct estimate_request q = {.input = trace_input_surface(scene, scattering_find("two_lobe.v1"), param, &model),
                                 .configuration = c,
                                 .n_configuration = 1,
                                 .n_path = &n_path,
                                 .seed = 3};
    if (estimate_run(&q, pool, NULL, &e, &err) != STATUS_OK) fail_msg("%s", err.text);
    double coverage = 2 * radius_m / tile_m;
    for (int k = 0; k < 3; k++) {
        double want = coverage * single_scattering(c, param, k), se = sqrt(e.var[k]);
        if (!(fabs(e.mean[k] - want) < 4 * se + 5e-3 * want) || se > 0.05 * want)
            fail_msg("camera %.0f/%.0f lamp %.0f/%.0f rotation %.0f, channel %d: %.6g +- %.2g, quadrature %.6g",
                     c->camera_theta_rad / RAD_PER_DEG, c->camera_phi_rad / RAD_PER_DEG,
                     c->light_theta_rad / RAD_PER_DEG, c->light_phi_rad / RAD_PER_DEG,
                     c->cloth_rotation_rad / RAD_PER_DEG, k, e.mean[k], se, want);
        joint->sum +=
            want * want / (se * se) * (e.mean[k] / want - 1); /* channels share paths, so their errors are correlated */
        joint->weight += want * want / (se * se);
    }
}

static void single_scattering_from_straight_fibers(void **state)
{
    (void)state;
    /* the camera leans along the fibers, so that the covered share of the picture is 2 r / tile */
    static const double angle_deg[][5] = {/* camera theta, phi, lamp theta, phi, rotation */
                                          {0, 0, 30, 90, 0},     {0, 0, 30, 0, 90},     {30, 0, 30, 180, 0},
                                          {40, 90, 35, 270, 90}, {40, 270, 50, 80, 90}, {60, 180, 62, 5, 0},
                                          {20, 45, 30, 235, 45}, {0, 0, 0, 0, 30}};
    const double y_z[1][2] = {{0.13e-3, 0}};
    struct fiber_set f;
    struct scene *scene = NULL;
    struct thread_pool *pool = NULL;
    struct joint joint = {0, 0};
    hand_straight(&f, 1, y_z, tile_m, radius_m);
    assert_int_equal(scene_new(&f, &(struct scene_option){true}, &scene, NULL), STATUS_OK);
    assert_int_equal(thread_pool_new(0, &pool, NULL), STATUS_OK);
    for (size_t i = 0; i < sizeof angle_deg / sizeof angle_deg[0]; i++) {
        const double *a = angle_deg[i];
        struct configuration c = {a[2] * RAD_PER_DEG,
                                  a[3] * RAD_PER_DEG,
                                  a[0] * RAD_PER_DEG,
                                  a[1] * RAD_PER_DEG,
                                  a[4] * RAD_PER_DEG,
                                  0.61,
                                  0.10,
                                  100,
                                  8 * tile_m};
        const double narrow[9] = {
            0.02, 0.01, 0.03, 0.01, 0.02, 0.001, 2 * RAD_PER_DEG, 12 * RAD_PER_DEG, 20 * RAD_PER_DEG};
        const double wide[9] = {
            0.01, 0.02, 0.03, 0.03, 0.02, 0.01, 8 * RAD_PER_DEG, 30 * RAD_PER_DEG, 40 * RAD_PER_DEG};
        check(&c, wide, pool, scene, &joint);
        check(&c, narrow, pool, scene, &joint);
    }
    double off = joint.sum / joint.weight, se = sqrt(3 / joint.weight);
    print_message("mean relative deviation of all comparisons: %.4f +- %.4f\n", off, se);
    assert_true(fabs(off) < 4 * se + 2e-3 && se < 0.005);
    thread_pool_free(pool);
    scene_free(scene);
    fiber_set_release(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(single_scattering_from_straight_fibers)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
