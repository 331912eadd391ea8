/* Tables of the medulla: against walks of other random numbers at places between their nodes, and where light is
 * scattered once, in closed form. Their compression: on a sum of products that is known.
 */
#include "renderer/scattering/models/fur/medulla.h"
#include "renderer/scattering/models/fur/medulla_fit.h"
#include "renderer/scattering/models/fur/medulla_trace.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* Sums of products of the misses against two independent sets of walks: noise has the mean 0 in them. */
struct misses {
    double error, all;
};

static double relative(const struct misses *m) { return sqrt(fmax(m->error, 0) / m->all); }

static double uniform(struct rng *r, double lower, double upper) { return lower + (upper - lower) * rng_double(r); }

static void around_against_walks(void **unused)
{
    (void)unused;
    enum { N_PLACE = 24, N_WALK = 20000 };
    struct misses all = {0, 0};
    struct rng r;
    rng_start(&r, &(struct rng_key){81, 0, 0, 0}, 0, 0);
    for (int i = 0; i < N_PLACE; i++) {
        const struct medulla_medium medium = {expm1(uniform(&r, 0.05, 2)), uniform(&r, 0, 0.8)};
        double offset = uniform(&r, 0, M_PI_2);
        float walk[2][MEDULLA_N_TURN];
        struct medulla_around around;
        struct medulla_ray ray;
        for (int k = 0; k < 2; k++)
            medulla_trace_round(&medium, fmin(sin(offset), MEDULLA_MOST_OFFSET), N_WALK, (uint64_t)(5000 + 2 * i + k),
                                walk[k]);
        medulla_around_init(&around, medium.g);
        medulla_ray_init(&around, medium.depth, offset, &ray);
        for (int j = 0; j < MEDULLA_N_TURN; j++) {
            double got = medulla_ray_density(&ray, 2 * M_PI * j / MEDULLA_N_TURN, NULL);
            all.error += (got - (double)walk[0][j]) * (got - (double)walk[1][j]);
            all.all += (double)walk[0][j] * (double)walk[1][j];
        }
    }
    print_message("around: off by %.4f of the root mean square\n", relative(&all));
    assert_true(relative(&all) < 0.03);
}

/* Weighted by the energy, cos^2 th_i cos^2 th_o. */
static void along_against_walks(void **unused)
{
    (void)unused;
    enum { N_PLACE = 8, N_WALK = 6000 };
    struct misses all[MEDULLA_N_HALF] = {{0, 0}};
    struct rng r;
    rng_start(&r, &(struct rng_key){82, 0, 0, 0}, 0, 0);
    for (int i = 0; i < N_PLACE; i++) {
        const struct medulla_medium medium = {expm1(uniform(&r, 0.05, 1.6)), uniform(&r, 0, 0.8)};
        static float walk[2][MEDULLA_N_HALF][MEDULLA_N_SUM][MEDULLA_N_DIFFERENCE];
        static struct medulla_along along;
        struct error err;
        for (int k = 0; k < 2; k++)
            assert_int_equal(medulla_trace_slab(&medium, N_WALK, (uint64_t)(6000 + 2 * i + k), walk[k], &err),
                             STATUS_OK);
        assert_int_equal(medulla_along_init(&along, medium.depth, medium.g, NULL, &err), STATUS_OK);
        for (int a = 0; a < MEDULLA_N_SUM; a++)
            for (int b = 0; b < MEDULLA_N_DIFFERENCE; b++) {
                double sum = a * M_PI / (MEDULLA_N_SUM - 1), difference = b * M_PI / (MEDULLA_N_DIFFERENCE - 1);
                float value[MEDULLA_N_HALF];
                if (sum + difference >= M_PI) continue;
                double weight = 0.5 * (cos(sum) + cos(difference)), scale = medulla_slab_weight(sum, difference);
                medulla_along_at(&along, (float)sum, (float)difference, value, NULL);
                for (int half = 0; half < MEDULLA_N_HALF; half++) {
                    double x = (double)walk[0][half][a][b] / scale, y = (double)walk[1][half][a][b] / scale,
                           got = (double)value[half];
                    all[half].error += weight * weight * (got - x) * (got - y);
                    all[half].all += weight * weight * x * y;
                }
            }
    }
    print_message("along: off by %.4f (back) and %.4f (through) of the root mean square\n", relative(&all[0]),
                  relative(&all[1]));
    for (int half = 0; half < MEDULLA_N_HALF; half++) assert_true(relative(&all[half]) < 0.03);
}

/* Light that is scattered once leaves with the function of Henyey and Greenstein, wherever the ray passes. */
static void scattered_once(void **unused)
{
    (void)unused;
    static const double g[4] = {0, 0.3, 0.55, 0.75};
    for (int k = 0; k < 4; k++) {
        struct medulla_around around;
        struct misses all = {0, 0};
        medulla_around_init(&around, g[k]);
        for (double offset = 0; offset < 1.6; offset += 0.3) {
            struct medulla_ray ray;
            medulla_ray_init(&around, 1e-4, offset, &ray);
            double integral = 0;
            for (int j = 0; j < 720; j++) {
                double psi = 2 * M_PI * j / 720, got = medulla_ray_density(&ray, psi, NULL);
                double want = (1 - g[k] * g[k]) / (2 * M_PI * (1 + g[k] * g[k] + 2 * g[k] * cos(psi)));
                integral += got * 2 * M_PI / 720;
                all.error += (got - want) * (got - want);
                all.all += want * want;
            }
            assert_true(fabs(integral - 1) < 1e-4);
        }
        print_message("g %.2f: off by %.4f\n", g[k], relative(&all));
        assert_true(relative(&all) < 0.03);
    }
}

/* M is symmetric by its coordinates; its integral against cos^2 is 1 from every angle. */
static void along_keeps_all_light(void **unused)
{
    (void)unused;
    static struct medulla_along along;
    struct error err;
    enum { N = 2000 };
    assert_int_equal(medulla_along_init(&along, 1.7, 0.6, NULL, &err), STATUS_OK);
    for (double theta = -1.5; theta < 1.55; theta += 0.3) {
        double integral[MEDULLA_N_HALF] = {0};
        for (int i = 0; i < N; i++) {
            double out = M_PI * ((i + 0.5) / N - 0.5), c = cos(out);
            float value[MEDULLA_N_HALF];
            medulla_along_at(&along, (float)(theta + out), (float)(theta - out), value, NULL);
            for (int half = 0; half < MEDULLA_N_HALF; half++) integral[half] += (double)value[half] * c * c * M_PI / N;
        }
        for (int half = 0; half < MEDULLA_N_HALF; half++) assert_true(fabs(integral[half] - 1) < 3e-3);
    }
}

/* Compression of a sum of three products finds it again. */
static void compression(void **unused)
{
    (void)unused;
    enum { RANK = 3 };
    static const int n[4] = {7, 6, 5, 40};
    static float x[7 * 6 * 5 * 40];
    double factor[4][40 * RANK], left, *f[4] = {factor[0], factor[1], factor[2], factor[3]};
    struct error err;
    for (int i = 0; i < n[0]; i++)
        for (int j = 0; j < n[1]; j++)
            for (int k = 0; k < n[2]; k++)
                for (int l = 0; l < n[3]; l++)
                    x[((i * n[1] + j) * n[2] + k) * n[3] + l] =
                        (float)((i + 1.0) * exp(-0.3 * j) * (1 + k) + exp(-0.1 * i * i) * (2 + j) * (l > 20) +
                                (i > 3) * (1 + j * j) * (5 - k) * exp(-0.01 * (l - 9) * (l - 9)));
    assert_int_equal(medulla_fit(x, n, RANK, 600, 1, f, &left, &err), STATUS_OK);
    double error = 0, all = 0;
    for (int i = 0, at = 0; i < n[0]; i++)
        for (int j = 0; j < n[1]; j++)
            for (int k = 0; k < n[2]; k++)
                for (int l = 0; l < n[3]; l++, at++) {
                    double sum = 0;
                    for (int r = 0; r < RANK; r++)
                        sum += f[0][i * RANK + r] * f[1][j * RANK + r] * f[2][k * RANK + r] * f[3][l * RANK + r];
                    error += (sum - (double)x[at]) * (sum - (double)x[at]);
                    all += (double)x[at] * (double)x[at];
                }
    error = sqrt(error / all);
    print_message("compression leaves %.2g, stated %.2g\n", error, left);
    assert_true(error < 1e-3 && fabs(left - error) < 1e-3);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(around_against_walks), cmocka_unit_test(along_against_walks),
        cmocka_unit_test(scattered_once),       cmocka_unit_test(along_keeps_all_light),
        cmocka_unit_test(compression),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
