/* The path tracer with a discrepancy: all light of a flat cloth under one direction of light is multiplied by the one
 * factor of that pair of directions, whatever its path was. */
#include "renderer/transport/discrepancy.h"
#include "tests/support/tracer/estimate_fixture.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static struct estimate_fixture fixture;

static int set_up(void **state)
{
    (void)state;
    return estimate_fixture_init(&fixture);
}

static int tear_down(void **state)
{
    (void)state;
    estimate_fixture_release(&fixture);
    return 0;
}

static const struct discrepancy bump = {.n = 2,
                                        .scale = {0.75, 0.75, 1.5, 0.75},
                                        .place = {{0.1, 0.8, 1.2, 0.8}, {0.5, 0.4, 0.9, 0.9}},
                                        .weight = {{0.3, 0.1, -0.2}, {-0.1, 0.2, 0.25}}};

static void far_away(struct configuration *c)
{
    c->light = LIGHT_DIRECTIONAL;
    c->camera = CAMERA_FAR_FIELD;
}

static void all_light_has_the_factor_of_its_directions(void **state)
{
    (void)state;
    enum { N = 4 };
    const size_t n_path[N] = {512, 512, 512, 512};
    struct estimate_request q = estimate_fixture_request(&fixture, n_path, N);
    struct estimate plain[N], with[N];
    for (size_t i = 0; i < N; i++) far_away(&fixture.configuration[i]);
    estimate_fixture_run(&q, 1, plain);
    q.input.discrepancy = &bump;
    estimate_fixture_run(&q, 1, with);
    for (size_t i = 0; i < N; i++) {
        const struct configuration *c = &fixture.configuration[i];
        const double light = cos(c->light_theta_rad), camera = cos(c->camera_theta_rad);
        const double between = light * camera + sin(c->light_theta_rad) * sin(c->camera_theta_rad) *
                                                    cos(c->camera_phi_rad - c->light_phi_rad);
        double factor[3];
        discrepancy_factor(&bump, light, camera, between, factor);
        assert_true(fabs(factor[0] - 1.0) > 0.01);
        for (int k = 0; k < 3; k++) {
            assert_true(plain[i].mean[k] > 0.0);
            assert_true(fabs(with[i].mean[k] / (plain[i].mean[k] * factor[k]) - 1.0) < 2e-5);
            assert_true(fabs(with[i].jac[(size_t)k * q.input.model->n_param + (size_t)k] /
                                 (plain[i].jac[(size_t)k * q.input.model->n_param + (size_t)k] * factor[k]) -
                             1.0) < 2e-4);
        }
    }
}

/* Light of an even environment comes from all directions: its mean lies between the smallest and the largest factor,
 * and what the camera sees beside the cloth has none. */
static void light_of_an_environment_has_the_factors_of_its_directions(void **state)
{
    (void)state;
    const size_t n_path[1] = {2048};
    struct estimate_request q = estimate_fixture_request(&fixture, n_path, 1);
    struct estimate plain, with;
    fixture.configuration[0].light = LIGHT_NO_LAMP;
    for (int k = 0; k < 3; k++) fixture.configuration[0].environment_rgb[k] = 1.0;
    estimate_fixture_run(&q, 1, &plain);
    q.input.discrepancy = &bump;
    estimate_fixture_run(&q, 1, &with);
    for (int k = 0; k < 3; k++) {
        const double ratio = with.mean[k] / plain.mean[k];
        assert_true(fabs(ratio - 1.0) > 0.01 && ratio > exp(-DISCREPANCY_MOST) && ratio < exp(DISCREPANCY_MOST));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(all_light_has_the_factor_of_its_directions),
        cmocka_unit_test(light_of_an_environment_has_the_factors_of_its_directions),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
