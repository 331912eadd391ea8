/* Near fields of round dielectric fibers: their mean over the width of the fiber is the far field of dielectric.v1, in
 * closed form and as rendered fibers; the model of Chiang et al. 2016 against its published formulas; the energy from
 * both sides.
 */
#include "base/angle.h"
#include "renderer/estimate/estimate.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/model/fiber_angles.h"
#include "tests/support/model/model_furnace.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

#include "tests/support/model/near_view_sum.h"
#include "tests/support/model/prepared_model.h"

static const char *const near_id[3] = {"dielectric_near.v1", "chiang.v1", "chiang_albedo.v1"};

/* The tables of dielectric.v1 are read by straight lines: between azimuths, a Gaussian of width w is off by at most
 * step^2 / (8 w^2) of its peak, 0.8 % for R of 4 degrees, and R is a part of the largest S (test_dielectric.c). */
static void mean_is_the_far_field(void **unused)
{
    (void)unused;
    enum { N_PLACE = 1500, N_PHI = 19 };
    static const double set[3][3] = {{1.55, 8, 15}, {1.35, 4, 4}, {1.75, 20, 40}};
    static const double theta_deg[4][2] = {{0, 0}, {-40, 35}, {66, -70}, {-75, 40}};
    const struct scattering_model *near = scattering_find("dielectric_near.v1"),
                                  *far = scattering_find("dielectric.v1");
    assert_true(near->near_field && !far->near_field);
    for (int k = 0; k < 3; k++) {
        const double param[6] = {0.9, 0.5, 0.1, set[k][0], set[k][1] * RAD_PER_DEG, set[k][2] * RAD_PER_DEG};
        struct scattering_state *a = prepare(near, param), *b = prepare(far, param);
        for (int t = 0; t < 4; t++) {
            const double theta[2] = {theta_deg[t][0] * RAD_PER_DEG, theta_deg[t][1] * RAD_PER_DEG};
            double got[N_PHI][3] = {{0}}, want[N_PHI][3] = {{0}}, top = 0;
            for (int j = 0; j < N_PHI; j++) {
                double phi = j * 10.3 * RAD_PER_DEG;
                for (int i = 0; i < N_PLACE; i++)
                    near_at(near, a, theta, phi, scattering_view_azimuth_rad(near, i, N_PLACE), got[j]);
                near_at(far, b, theta, phi, 0.4, want[j]);
                for (int c = 0; c < 3; c++) top = fmax(top, want[j][c]);
            }
            for (int j = 0; j < N_PHI; j++)
                for (int c = 0; c < 3; c++)
                    if (!(fabs(got[j][c] / N_PLACE - want[j][c]) < 0.005 * want[j][c] + 0.004 * top))
                        fail_msg("set %d, angles %d, azimuth %g, channel %d: mean %g, far field %g (largest %g)", k, t,
                                 j * 10.3, c, got[j][c] / N_PLACE, want[j][c], top);
        }
        near->release(a);
        far->release(b);
    }
}

/* ---- the published model ---- */

static double logistic_cdf(double x, double s) { return 1 / (1 + exp(-x / s)); }

/* Shares of the modes by the published recursion: A_0 = F, A_1 = (1 - F)^2 T, A_p = A_(p-1) T F, and the rest A_p T F /
 * (1 - T F); fresnel by amplitudes. */
static void published_shares(double cos_theta, double h, double eta, double sigma, double share[4])
{
    double sin_theta = sqrt(1 - cos_theta * cos_theta), sin_t = sin_theta / eta, cos_t = sqrt(1 - sin_t * sin_t);
    double index = sqrt(eta * eta - sin_theta * sin_theta) / cos_theta, cos_gamma = sqrt(1 - h * h / (index * index));
    double t = exp(-sigma * 2 * cos_gamma / cos_t), cosine = cos_theta * sqrt(1 - h * h);
    double inside = sqrt(1 - (1 - cosine * cosine) / (eta * eta));
    double rs = (cosine - eta * inside) / (cosine + eta * inside),
           rp = (eta * cosine - inside) / (eta * cosine + inside);
    double f = 0.5 * (rs * rs + rp * rp);
    share[0] = f;
    share[1] = (1 - f) * (1 - f) * t;
    share[2] = share[1] * t * f;
    share[3] = share[2] * f * t / (1 - t * f);
}

/* The longitudinal lobe in the published form exp(-sin sin / v) I0(cos cos / v) / (2 v sinh(1 / v)), I0 by a sum. */
static double published_along(double theta_i, double theta_o, double v)
{
    double a = cos(theta_i) * cos(theta_o) / v, sum = 0;
    enum { N = 4000 };
    for (int i = 0; i < N; i++) sum += exp(a * (cos(2 * M_PI * (i + 0.5) / N) - 1)) / N;
    return sum * exp(a - sin(theta_i) * sin(theta_o) / v - 1 / v) / (v * -expm1(-2 / v));
}

/* S cos th_i as published. */
static double published_at(const double *param, double sigma, double theta_i, double theta_o, double h, double phi)
{
    double bm = param[4], bn = param[5], root = 0.726 * bm + 0.812 * bm * bm + 3.7 * pow(bm, 20), share[4], sum = 0;
    double s = 0.626657069 * (0.265 * bn + 1.194 * bn * bn + 5.372 * pow(bn, 22)), eta = param[3];
    const double v[4] = {root * root, 0.25 * root * root, 4 * root * root, 4 * root * root};
    double index = sqrt(eta * eta - pow(sin(theta_o), 2)) / cos(theta_o);
    published_shares(cos(theta_o), h, eta, sigma, share);
    for (int p = 0; p < 4; p++) {
        double x = remainder(phi - (2 * p * asin(h / index) - 2 * asin(h) + p * M_PI), 2 * M_PI), e = exp(-fabs(x) / s);
        double d = e / (s * (1 + e) * (1 + e)) / (logistic_cdf(M_PI, s) - logistic_cdf(-M_PI, s));
        sum += published_along(theta_i, theta_o, v[p]) * share[p] * (p < 3 ? d : 0.5 / M_PI);
    }
    return sum;
}

static double published(const double *param, double sigma, double theta_o, double h, double phi)
{
    return published_at(param, sigma, -theta_o, theta_o, h, phi);
}

/* On the cone th_i = -th_o the difference angle is th_o, and a(th) the same at every azimuth and offset: the model is
 * the published one up to a factor. Also the same fiber by its color: sigma = (ln C / g)^2 with g = 5.888415 at a
 * beta_N of 0.3, so C = 0.5 is an absorption of 0.0138565 per radius. */
static void published_model(void **unused)
{
    (void)unused;
    static const double set[3][3] = {{1.55, 0.2, 0.3}, {1.35, 0.08, 0.12}, {1.75, 0.9, 0.95}},
                        theta_deg[3] = {0, 30, -70};
    const struct scattering_model *m = scattering_find("chiang.v1"), *by_color = scattering_find("chiang_albedo.v1");
    for (int k = 0; k < 3; k++) {
        const double param[6] = {0.9, 0.5, 0.1, set[k][0], set[k][1], set[k][2]};
        struct scattering_state *s = prepare(m, param);
        for (int t = 0; t < 3; t++)
            for (int c = 0; c < 3; c++) {
                double factor = 0;
                for (int j = 0; j < 60; j++) {
                    double theta = theta_deg[t] * RAD_PER_DEG, h = -0.97 + 0.033 * j, phi = 0.1 + 0.41 * j,
                           got[3] = {0};
                    const double angles[2] = {-theta, theta};
                    near_at(m, s, angles, phi, asin(h), got);
                    double ratio = got[c] / published(param, -0.5 * log(param[c]), theta, h, phi);
                    if (j == 0) factor = ratio;
                    if (!(fabs(ratio / factor - 1) < 1e-4))
                        fail_msg("set %d, %g degrees, h %g, azimuth %g: off by %g", k, theta_deg[t], h, phi,
                                 ratio / factor - 1);
                }
            }
        m->release(s);
    }
    const double c_t = exp(-2 * 0.0138565189), physical[6] = {c_t, c_t, c_t, 1.55, 0.2, 0.3},
                 color[6] = {0.5, 0.5, 0.5, 1.55, 0.2, 0.3}, angles[2] = {0.3, -0.2};
    struct scattering_state *a = prepare(m, physical), *b = prepare(by_color, color);
    for (int j = 0; j < 40; j++) {
        double x[3] = {0}, y[3] = {0};
        near_at(m, a, angles, 0.16 * j, 1.5 - 0.07 * j, x);
        near_at(by_color, b, angles, 0.16 * j, 1.5 - 0.07 * j, y);
        assert_true(fabs(x[1] / y[1] - 1) < 3e-5);
    }
    m->release(a);
    by_color->release(b);
}

/* hair_mixture.v1 is the mixture of two of the published model, at any two angles and with its division by cos th_i. */
static void mixture_of_the_published_model(void **unused)
{
    (void)unused;
    const struct scattering_model *m = scattering_find("hair_mixture.v1");
    const double param[13] = {0.9, 0.5, 0.1, 1.55, 0.2, 0.3, 0.05, 0.3, 0.7, 2.6, 0.8, 0.9, 0.35};
    struct scattering_state *s = prepare(m, param);
    for (int j = 0; j < 200; j++) {
        const double angles[2] = {-1.4 + 0.0139 * j, 1.3 - 0.67 * (j % 5)}, h = -0.97 + 0.033 * (j % 60),
                     phi = 0.1 + 0.41 * j;
        double got[3] = {0};
        near_at(m, s, angles, phi, asin(h), got);
        for (int c = 0; c < 3; c++) {
            double want = 0;
            for (int k = 0; k < 2; k++)
                want += (k == 0 ? 0.65 : 0.35) *
                        published_at(param + 6 * k, -0.5 * log(param[6 * k + c]), angles[0], angles[1], h, phi);
            /* 1e-4: the model's Bessel function and angles are of single precision */
            if (!(fabs(got[c] * cos(angles[0]) - want) < 1e-4 * want + 1e-12))
                fail_msg("angles %g and %g, h %g, azimuth %g: %g instead of %g", angles[0], angles[1], h, phi,
                         got[c] * cos(angles[0]), want);
        }
    }
    m->release(s);
}

/* ---- energy ---- */

/* The mean over the views keeps all light, from both sides; a single view keeps it within a bound. Colors at 1 by the
 * score, as C_T = 1 is beyond the bounds. */
static void energy_from_both_sides(void **unused)
{
    (void)unused;
    static const double theta_deg[4] = {0, -30, 60, 80};
    double worst_mean = 0;
    for (int k = 0; k < 3; k++) {
        const struct scattering_model *m = scattering_find(near_id[k]);
        double param[SCATTERING_MAX_PARAM];
        for (size_t p = 0; p < m->n_param; p++)
            param[p] = m->param[p].channel >= 0 ? m->param[p].upper : m->param[p].start;
        struct scattering_state *s = prepare(m, param);
        for (int t = 0; t < 4; t++)
            for (int side = 0; side < 2; side++) {
                double sum[3];
                const struct model_furnace q = {.n_theta = 720, .n_phi = 90, .n_view = 24};
                model_furnace(m, s, &q, theta_deg[t] * RAD_PER_DEG, side == 0, sum);
                worst_mean = fmax(worst_mean, fabs(sum[0] - 1));
                if (!(sum[0] < 1 + 1e-3 && sum[0] > 1 - 4e-3))
                    fail_msg("%s, %g degrees, side %d: %.5f", m->id, theta_deg[t], side, sum[0]);
            }
        m->release(s);
    }
    print_message("mean over the views: off by at most %.5f, of which C_T = 0.999 absorbs 0.0013\n", worst_mean);
}

static double single_view(const struct scattering_model *m, const struct scattering_state *s, double theta_o, double h)
{
    enum { N_THETA = 720, N_PHI = 180 };
    double sum[3] = {0}, total = 0;
    for (int i = 0; i < N_THETA; i++) {
        const double angles[2] = {M_PI * ((i + 0.5) / N_THETA - 0.5), theta_o};
        sum[0] = 0;
        for (int j = 0; j < N_PHI; j++) near_at(m, s, angles, 2 * M_PI * (j + 0.5) / N_PHI, asin(h), sum);
        total += sum[0] * cos(angles[0]) * cos(angles[0]) * (M_PI / N_THETA) * (2 * M_PI / N_PHI);
    }
    return total;
}

/* The scale a(th) belongs to the mixture of modes of the mean. At the rim R dominates, whose lobe has another width:
 * the light of one place differs from 1 there, most at grazing angles. */
static void energy_of_one_view(void **unused)
{
    (void)unused;
    static const double theta_deg[4] = {0, 30, 60, 80}, bound[4] = {0.02, 0.02, 0.03, 0.2};
    const struct scattering_model *m = scattering_find("dielectric_near.v1");
    const double param[6] = {0.999, 0.999, 0.999, 1.55, 8 * RAD_PER_DEG, 15 * RAD_PER_DEG};
    struct scattering_state *s = prepare(m, param);
    for (int t = 0; t < 4; t++) {
        double worst = 0;
        for (double h = -0.99; h < 1; h += 0.18) {
            double sum = single_view(m, s, theta_deg[t] * RAD_PER_DEG, h);
            worst = fabs(sum - 1) > fabs(worst) ? sum - 1 : worst;
        }
        print_message("%g degrees: one place of the width keeps %+.4f of the light at worst\n", theta_deg[t], worst);
        assert_true(fabs(worst) < bound[t]);
    }
    m->release(s);
}

/* ---- the tracer ---- */

enum { N_CONFIGURATION = 4, N_PATH = 200000 };

static void render(const struct scattering_model *m, struct estimate *e)
{
    /* fibers so far from each other that little light meets a second one */
    static const double radius_m = 10e-6, pitch_m = 120e-6, y_z[1][2] = {{0.25, 0}};
    static const double theta_deg[N_CONFIGURATION][4] = {
        {30, 90, 20, 270}, {60, 60, 10, 200}, {20, 0, 50, 120}, {70, 250, 40, 80}};
    const double param[6] = {0.8, 0.4, 0.1, 1.55, 10 * RAD_PER_DEG, 12 * RAD_PER_DEG};
    const double place[1][2] = {{pitch_m * y_z[0][0], 0}};
    struct fiber_set f;
    struct scene *scene = NULL;
    struct thread_pool *pool = NULL;
    struct appearance model;
    struct configuration c[N_CONFIGURATION];
    size_t n_path[N_CONFIGURATION];
    struct error err = {0};
    hand_straight(&f, 1, place, pitch_m, radius_m);
    assert_int_equal(scene_new(&f, &(struct scene_option){.black_sheet = true}, &scene, NULL), STATUS_OK);
    fiber_set_release(&f);
    for (int k = 0; k < N_CONFIGURATION; k++) {
        const double *a = theta_deg[k];
        n_path[k] = N_PATH;
        c[k] = (struct configuration){.light_theta_rad = a[0] * RAD_PER_DEG,
                                      .light_phi_rad = a[1] * RAD_PER_DEG,
                                      .camera_theta_rad = a[2] * RAD_PER_DEG,
                                      .camera_phi_rad = a[3] * RAD_PER_DEG,
                                      .crop_m = 1,
                                      .light = LIGHT_DIRECTIONAL,
                                      .camera = CAMERA_FAR_FIELD};
    }
    struct estimate_request q = {.input = trace_input_surface(scene, m, param, &model),
                                 .configuration = c,
                                 .n_configuration = N_CONFIGURATION,
                                 .n_path = n_path,
                                 .seed = 7};
    assert_int_equal(thread_pool_new(0, &pool, NULL), STATUS_OK);
    if (estimate_run(&q, pool, NULL, e, &err) != STATUS_OK) fail_msg("%s", err.text);
    thread_pool_free(pool);
    scene_free(scene);
}

/* Rays meet all places of the width alike, so fibers that are seen whole have the radiance of the far field. This fails
 * when v of the frame is not the normal at the hit. */
static void single_fibers_look_the_same(void **unused)
{
    (void)unused;
    struct estimate near[N_CONFIGURATION], far[N_CONFIGURATION];
    render(scattering_find("dielectric_near.v1"), near);
    render(scattering_find("dielectric.v1"), far);
    for (int k = 0; k < N_CONFIGURATION; k++)
        for (int c = 0; c < 3; c++) {
            double ratio = near[k].mean[c] / far[k].mean[c];
            double se = ratio * sqrt(near[k].var[c] / (near[k].mean[c] * near[k].mean[c]) +
                                     far[k].var[c] / (far[k].mean[c] * far[k].mean[c]));
            if (c == 0) print_message("configuration %d: ratio %.4f +- %.4f\n", k, ratio, se);
            assert_true(se < 0.03);
            assert_true(fabs(ratio - 1) < 3.7 * se + 0.005); /* 12 comparisons; 0.005: tables of the far field */
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(mean_is_the_far_field),
        cmocka_unit_test(published_model),
        cmocka_unit_test(mixture_of_the_published_model),
        cmocka_unit_test(energy_from_both_sides),
        cmocka_unit_test(energy_of_one_view),
        cmocka_unit_test(single_fibers_look_the_same),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
