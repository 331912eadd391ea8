/* Profiles of a single fiber by rays through it (fiber_rays.h), and fur.v1 fitted to them. `make bench-models` fits all
 * ten published fibers.
 */
#include "base/angle.h"
#include "optimizer/fit/profile/profile_fit.h"
#include "renderer/scattering/models/dielectric/dielectric_ray.h"
#include "tests/support/fiber/fiber_rays.h"
#include "tests/support/statistics_test.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

/* Nothing is lost where nothing absorbs; through an absorbing cylinder without walls or medulla comes the mean of
 * exp(-2 sigma sqrt(1 - h^2) / cos th). */
static void rays_keep_their_light(void **unused)
{
    enum { N_RAY = 20000 };
    struct fiber_profile p;
    const double theta = 0.6;
    (void)unused;
    for (int k = 0; k < PUBLISHED_N_FIBER; k++) {
        struct ray_fiber f = published_fiber(k);
        f.sigma_ca = f.sigma_ma = 0;
        assert_true(fiber_rays_profile(&f, theta, N_RAY / 10, 1, &p) > 1 - 1e-12);
        fiber_profile_release(&p);
    }
    const struct ray_fiber clear = {.eta = 1, .kappa = 0.5, .layers = 1, .sigma_ma = 0.7, .sigma_ca = 0.7};
    double through = 0;
    for (int i = 0; i < 1000; i++) {
        const double h = (i + 0.5) / 1000;
        through += exp(-2 * clear.sigma_ca * sqrt(1 - h * h) / cos(theta)) / 1000;
    }
    const double share = fiber_rays_profile(&clear, theta, N_RAY, 2, &p);
    assert_true(fabs(share - through) < 4 * sqrt(through * (1 - through) / N_RAY));
    fiber_profile_release(&p);
}

/* Light that a black fiber mirrors, by azimuth: a smooth cylinder sends the share F cos(phi / 2) / 4 of it to each
 * radian, F the reflectance of a layer of two boundaries where the ray is mirrored. A roughness of half a degree blurs
 * that by less than a bin. */
static void mirrored_light(void **unused)
{
    enum { N_RAY = 300000 };
    const struct ray_fiber f = {.eta = 1.5,
                                .kappa = 0.5,
                                .layers = 1,
                                .beta_rad = 2 * RAD_PER_DEG,
                                .gamma_rad = 0.5 * RAD_PER_DEG,
                                .sigma_ma = 60,
                                .sigma_ca = 60};
    struct fiber_profile p;
    const double theta_i = -30 * RAD_PER_DEG, bin = 5 * RAD_PER_DEG, step = 2 * RAD_PER_DEG;
    double chi_square = 0;
    (void)unused;
    fiber_rays_profile(&f, theta_i, N_RAY, 3, &p);
    for (int deg = 20; deg <= 160; deg += 5) {
        double share = 0, expected = 0;
        for (size_t i = 0; i < p.n; i++)
            if (fabs(p.row[i].phi_rad - deg * RAD_PER_DEG) < 1e-6) {
                const double theta = p.row[i].theta_o_rad,
                             solid = (sin(theta + step / 2) - sin(theta - step / 2)) * bin;
                share += p.row[i].radiance[0] * cos(theta) * solid / cos(theta_i);
            }
        for (int k = 0; k < 50; k++) {
            const double phi = deg * RAD_PER_DEG + bin * ((k + 0.5) / 50 - 0.5);
            double single[2], layer = 0;
            fresnel_polarised(cos(theta_i) * cos(phi / 2), f.eta, single, NULL);
            for (int q = 0; q < 2; q++) layer += 0.5 * single[q] / (1 + single[q]);
            expected += layer * cos(phi / 2) / 4 * bin / 50;
        }
        chi_square += pow(share - expected, 2) * N_RAY / expected;
    }
    fiber_profile_release(&p);
    print_message("mirrored light: chi-square %.1f of 29 bins\n", chi_square);
    assert_true(chi_square_tail(chi_square, 29) > 1e-4);
}

/* The mouse: of the published fits the one with the least residual, 4.7 %. */
static void published_mouse(void **unused)
{
    enum { MOUSE = 4 };
    const struct scattering_model *m = scattering_find("fur.v1");
    const struct ray_fiber f = published_fiber(MOUSE);
    struct fit_parameter parameter[SCATTERING_MAX_PARAM];
    struct fit_option option;
    struct fiber_profile p;
    struct profile_fit fit;
    struct thread_pool *pool = NULL;
    struct error err = {0};
    (void)unused;
    assert_int_equal(thread_pool_new(2, &pool, &err), STATUS_OK);
    fiber_rays_profile(&f, -40 * RAD_PER_DEG, 300000, 5, &p);
    fit_option_init(&option);
    for (size_t k = 0; k < m->n_param; k++)
        parameter[k] = (struct fit_parameter){m->param[k].lower, m->param[k].upper, m->param[k].start, false};
    const struct profile_problem problem = {
        .model = m, .profile = &p, .parameter = parameter, .option = &option, .scale = 1, .pool = pool};
    assert_int_equal(profile_fit_run(&problem, "mouse", &fit, &err), STATUS_OK);
    print_message("mouse: residual %.2f %% of the range, %zu of %zu starts agree\n", 100 * fit.nrmse, fit.n_agree,
                  fit.n_start);
    assert_true(fit.converged && fit.nrmse < 0.047);
    assert_true(fabs(fit.param[scattering_param_index(m, "kappa")] - f.kappa) < 0.05);
    profile_fit_release(&fit);
    fiber_profile_release(&p);
    thread_pool_free(pool);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(rays_keep_their_light), cmocka_unit_test(mirrored_light),
                                       cmocka_unit_test(published_mouse)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
