/* Spherical-Gaussian lamps: their light and samples, the closed form of what a fiber scatters of it against
 * quadrature, path tracing under a sharp one against parallel light, and pictures under one as sums of those under
 * parallel light. */
#include "base/angle.h"
#include "base/rng.h"
#include "renderer/estimate/estimate.h"
#include "renderer/fast/fast_tables.h"
#include "renderer/fast/precompute/fast_precompute.h"
#include "renderer/transport/lamp.h"
#include "tests/support/cloth/hand_weave.h"
#include "tests/support/tracer/trace_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

static struct cloth {
    struct scene *scene;
    const struct scattering_model *model;
    double param[SCATTERING_MAX_PARAM];
    struct fast_tables tables;
} cloth;

static int set_up(void **state)
{
    static const double wide[] = {0.2, 0.1, 0.05, 0.9, 0.6, 0.4, 10, 30, 40};
    struct fiber_set f;
    struct error err = {0};
    (void)state;
    hand_weave_small(&f);
    if (scene_new(&f, &(struct scene_option){true}, &cloth.scene, &err) != STATUS_OK) fail_msg("%s", err.text);
    fiber_set_release(&f);
    cloth.model = scattering_find("two_lobe.v1");
    for (size_t p = 0; p < cloth.model->n_param; p++)
        cloth.param[p] = param_from_file_unit(&cloth.model->param[p], wide[p]);
    const struct fast_precompute_request q = {
        .scene = cloth.scene, .model = cloth.model, .param = cloth.param, .n_path = 6000, .cell_paths = 4};
    if (fast_precompute(&q, NULL, NULL, &cloth.tables, &err) != STATUS_OK) fail_msg("%s", err.text);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    fast_tables_release(&cloth.tables);
    scene_free(cloth.scene);
    return 0;
}

static struct configuration view_under(double sharpness)
{
    return (struct configuration){.light_theta_rad = 40 * RAD_PER_DEG,
                                  .light_phi_rad = 30 * RAD_PER_DEG,
                                  .camera_theta_rad = 20 * RAD_PER_DEG,
                                  .camera_phi_rad = 200 * RAD_PER_DEG,
                                  .light = sharpness > 0 ? LIGHT_GAUSSIAN : LIGHT_DIRECTIONAL,
                                  .light_sharpness = sharpness,
                                  .camera_distance_m = 1,
                                  .crop_m = 0.01};
}

/* The irradiance of a surface that faces the lamp is pi, and samples have the density that is stated: means of the
 * cosine, with their errors, for the widest and the sharpest lamp, too. */
static void lamp_light(void **state)
{
    static const double sharpness[] = {1, 10, 150, 1e5};
    enum { N = 20000 };
    (void)state;
    for (size_t i = 0; i < sizeof sharpness / sizeof *sharpness; i++) {
        struct configuration c = view_under(sharpness[i]);
        struct lamp l;
        struct rng rng;
        double irradiance = 0, square = 0, cosine = 0, cosine2 = 0, k = sharpness[i];
        lamp_init(&l, &c);
        rng_start(&rng, &(struct rng_key){.seed = 4}, (uint32_t)i, 0);
        for (int n = 0; n < N; n++) {
            const float at[3] = {1, 2, 3};
            float u[2], d[3], pdf;
            u[0] = rng_float(&rng);
            u[1] = rng_float(&rng);
            assert_true(lamp_sample(&l, at, u, d, &pdf));
            assert_true(fabsf(pdf - lamp_pdf(&l, at, d)) <= 1e-5f * pdf);
            double x = -((double)d[0] * (double)l.normal[0] + (double)d[1] * (double)l.normal[1] +
                         (double)d[2] * (double)l.normal[2]);
            double e = fmax(x, 0) * (double)lamp_radiance(&l, d) / (double)pdf;
            irradiance += e / N;
            square += e * e / N;
            cosine += x / N;
            cosine2 += x * x / N;
        }
        double expected = 1 / tanh(k) - 1 / k;
        assert_true(fabs(irradiance - M_PI) < 4 * sqrt(fmax(square - irradiance * irradiance, 0) / N) + 1e-4);
        assert_true(fabs(cosine - expected) < 4 * sqrt(fmax(cosine2 - cosine * cosine, 0) / N) + 1e-6);
    }
}

/* Quadrature over the Gaussian in rings around its axis, to 7 standard deviations. */
static void integrate(const struct scattering_state *s, const float axis[3], double k, const float wo[3], double rgb[3])
{
    enum { RINGS = 200, TURNS = 96 };
    float other[3] = {fabsf(axis[0]) < 0.9f ? 1.0f : 0, fabsf(axis[0]) < 0.9f ? 0 : 1.0f, 0}, side[2][3];
    double along = (double)axis[0] * (double)other[0] + (double)axis[1] * (double)other[1],
           inv = 1 / sqrt(1 - along * along);
    for (int a = 0; a < 3; a++) side[0][a] = (float)(inv * ((double)other[a] - along * (double)axis[a]));
    for (int a = 0; a < 3; a++)
        side[1][a] = axis[(a + 1) % 3] * side[0][(a + 2) % 3] - axis[(a + 2) % 3] * side[0][(a + 1) % 3];
    double most = fmin(2, 25 / k);
    memset(rgb, 0, 3 * sizeof *rgb);
    for (int i = 0; i < RINGS; i++)
        for (int j = 0; j < TURNS; j++) {
            double off = most * (i + 0.5) / RINGS, sine = sqrt(off * (2 - off)), turn = 2 * M_PI * (j + 0.5) / TURNS;
            float wi[3], value[3];
            for (int a = 0; a < 3; a++)
                wi[a] = (float)((1 - off) * (double)axis[a] + sine * cos(turn) * (double)side[0][a] +
                                sine * sin(turn) * (double)side[1][a]);
            cloth.model->eval(s, wi, wo, value, NULL);
            double weight = exp(-k * off) * 2 * M_PI * most / (RINGS * TURNS) *
                            sqrt((double)wi[1] * (double)wi[1] + (double)wi[2] * (double)wi[2]);
            for (int c = 0; c < 3; c++) rgb[c] += weight * (double)value[c];
        }
}

static void random_direction(struct rng *r, float d[3])
{
    double z = 1.8 * rng_double(r) - 0.9, phi = 2 * M_PI * rng_double(r), s = sqrt(1 - z * z);
    d[0] = (float)z;
    d[1] = (float)(s * cos(phi));
    d[2] = (float)(s * sin(phi));
}

/* The closed form takes slow factors at the middle of fast ones. What that leaves falls with the variance of the
 * Gaussian, 1 / sharpness: it is a second derivative of order 1 of the factors, and of (1 / gamma)^2 in azimuth, times
 * half of that variance, relative to the largest values. */
static void closed_form(void **state)
{
    static const double set[][9] = {{0.185, 0.047, 0.069, 0.999, 0.330, 0.354, 2.141, 10, 23.548},
                                    {0.745, 0.008, 0.070, 0.620, 0.553, 0.562, 1, 10, 19.823},
                                    {0.2, 0.1, 0.05, 0.9, 0.6, 0.4, 10, 30, 40}};
    static const double sharpness[] = {100, 300, 3000};
    (void)state;
    for (size_t i = 0; i < 3; i++) {
        struct scattering_state *s;
        double param[9];
        for (size_t p = 0; p < 9; p++) param[p] = param_from_file_unit(&cloth.model->param[p], set[i][p]);
        assert_int_equal(cloth.model->prepare(param, &s, NULL), STATUS_OK);
        for (size_t k = 0; k < 3; k++) {
            struct rng rng;
            double error2 = 0, square = 0;
            rng_start(&rng, &(struct rng_key){.seed = 8}, (uint32_t)(3 * i + k), 0);
            for (int n = 0; n < 40; n++) {
                float axis[3], wo[3], rgb[3];
                double exact[3];
                random_direction(&rng, wo);
                random_direction(&rng, axis);
                if (n % 2 == 0) axis[0] = -wo[0]; /* near the cone */
                float inv = sqrtf((1 - axis[0] * axis[0]) / (axis[1] * axis[1] + axis[2] * axis[2]));
                axis[1] *= inv;
                axis[2] *= inv;
                integrate(s, axis, sharpness[k], wo, exact);
                cloth.model->gaussian(s, axis, (float)sharpness[k], wo, rgb);
                for (int c = 0; c < 3; c++) {
                    error2 += ((double)rgb[c] - exact[c]) * ((double)rgb[c] - exact[c]);
                    square += exact[c] * exact[c];
                }
            }
            double error = sqrt(error2 / square);
            print_message("set %zu, sharpness %.0f: closed form within %.4f\n", i, sharpness[k], error);
            assert_true(error < 5 / sharpness[k] + 0.002);
        }
        cloth.model->release(s);
    }
}

static void estimate_of(const struct configuration *view, const struct fast_option *fast, size_t n_path, uint64_t seed,
                        struct estimate *e)
{
    struct error err = {0};
    struct appearance model;
    struct estimate_request r = {.input = trace_input_surface(cloth.scene, cloth.model, cloth.param, &model),
                                 .configuration = view,
                                 .n_configuration = 1,
                                 .n_path = &n_path,
                                 .seed = seed,
                                 .replica = fast != NULL};
    r.input.fast = fast;
    if (estimate_run(&r, NULL, NULL, e, &err) != STATUS_OK) fail_msg("%s", err.text);
}

static double z_of(const struct estimate *a, const struct estimate *b, int c)
{
    return fabs(a->mean[c] - b->mean[c]) / sqrt(a->var[c] + b->var[c]);
}

/* A lamp of half a degree is parallel light; and light from a half degree is as bright. */
static void sharp_is_parallel(void **state)
{
    (void)state;
    struct configuration sharp = view_under(2e4), parallel = view_under(0);
    struct estimate a, b;
    estimate_of(&sharp, NULL, 8192, 21, &a);
    estimate_of(&parallel, NULL, 8192, 22, &b);
    for (int c = 0; c < 3; c++) assert_true(z_of(&a, &b, c) < 4);
}

/* The mean over N_PARALLEL directions of a Gaussian lamp, as often as it shines from there, of pictures under parallel
 * light, times the lamp's light over pi. */
static void parallel_sum(double sharpness, const struct fast_option *fast, struct estimate *sum)
{
    enum { N_PARALLEL = 192 };
    struct configuration c = view_under(sharpness);
    struct lamp l;
    lamp_init(&l, &c);
    double light = (double)lamp_gaussian_light(&l) / M_PI / N_PARALLEL;
    memset(sum, 0, sizeof *sum);
    for (int i = 0; i < N_PARALLEL; i++) {
        static const float at[3] = {0, 0, 0};
        const float u[2] = {((float)i + 0.5f) / N_PARALLEL, fmodf(0.61803399f * (float)i, 1)};
        float d[3], pdf;
        struct configuration one = view_under(0);
        struct estimate e;
        assert_true(lamp_sample(&l, at, u, d, &pdf));
        if (d[2] <= 0) continue; /* the black sheet hides it */
        one.light_theta_rad = acos((double)d[2]);
        one.light_phi_rad = atan2((double)d[1], (double)d[0]);
        estimate_of(&one, fast, 96, 100 + (uint64_t)i, &e);
        for (int k = 0; k < 3; k++) {
            sum->mean[k] += light * e.mean[k];
            sum->var[k] += light * light * e.var[k];
        }
    }
}

/* Light adds: a picture under a Gaussian lamp is the sum of those under parallel light from its directions, path traced
 * and by tables with traced hits within noise and 2 % for the directions that stand for all; and with visibility by
 * tables and the closed form within what sums of soft Gaussians leave of edges, 6 %. */
static void light_adds(void **state)
{
    const struct fast_option two = {.tables = &cloth.tables, .n_traced = 2},
                             none = {.tables = &cloth.tables, .visibility = FAST_TABLES};
    static const double sharpness[] = {10, 150, 10};
    const struct fast_option *const fast[] = {NULL, &two, &none};
    (void)state;
    for (int i = 0; i < 3; i++) {
        struct configuration c = view_under(sharpness[i]);
        struct estimate lamp, sum;
        estimate_of(&c, fast[i], 12288, 23, &lamp);
        parallel_sum(sharpness[i], fast[i], &sum);
        for (int k = 0; k < 3; k++) {
            double se = sqrt(lamp.var[k] + sum.var[k]), own = (i < 2 ? 0.02 : 0.06) * sum.mean[k];
            print_message("%d, sharpness %.0f: lamp %.4f, parallel %.4f, error %.4f\n", i, sharpness[i], lamp.mean[k],
                          sum.mean[k], se);
            assert_true(fabs(lamp.mean[k] - sum.mean[k]) < 4 * se + own);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(lamp_light), cmocka_unit_test(closed_form),
                                       cmocka_unit_test(sharp_is_parallel), cmocka_unit_test(light_adds)};
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
