/* The color matrix and the fall of light over patches of known colors: exact without noise, right within its errors
 * over many charts. */
#include "base/rng.h"
#include "optimizer/photographs/camera/chart_fit.h"
#include "optimizer/photographs/camera/chart_reference.h"
#include "optimizer/photographs/camera/color_matrix.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>

#include <cmocka.h>

static const double camera[9] = {0.61, 0.22, 0.05, 0.11, 0.74, 0.09, 0.02, 0.18, 0.48}; /* radiance to camera rgb */

/* A chart of known patches: camera rgb by the true light and noise, places as on a ColorChecker. */
struct chart_case {
    double measured[24][3], wanted[24][3], var[24][3], place[24][2];
    struct chart_patches list;
};

/* Light over the chart: linear terms, and a bend. */
static double light_at(const double place[2], double slope, double phi, double bend)
{
    return 1.0 + slope * (cos(phi) * place[0] + sin(phi) * place[1]) -
           bend * (place[0] * place[0] + place[1] * place[1]);
}

/* noise: relative, of bright patches more than of dark ones; reference: relative errors of the chart's own colors. */
static void make_case(struct chart_case *k, struct rng *rng, double slope, double phi, double bend, double noise,
                      double reference)
{
    for (size_t i = 0; i < 24; i++) {
        double z[8], real[3];
        for (size_t j = 0; j < 8; j += 2) rng_normal_pair(rng, z + j);
        k->place[i][0] = (double)(i % 6) / 2.6 - 2.5 / 2.6;
        k->place[i][1] = (double)(i / 6) / 2.6 - 1.5 / 2.6;
        color_chart_reference(false, i, k->wanted[i]);
        for (size_t c = 0; c < 3; c++) real[c] = k->wanted[i][c] * (1.0 + reference * (z[c] + z[3]));
        color_matrix_apply(camera, real, k->measured[i]);
        for (size_t c = 0; c < 3; c++) {
            k->measured[i][c] *= light_at(k->place[i], slope, phi, bend);
            k->var[i][c] = noise * noise * k->measured[i][c] * (k->measured[i][c] + 0.05);
            k->measured[i][c] += sqrt(k->var[i][c]) * z[4 + c];
        }
    }
    k->list = (struct chart_patches){24,
                                     (const double(*)[3])k->measured,
                                     (const double(*)[3])k->wanted,
                                     (const double(*)[3])k->var,
                                     (const double(*)[2])k->place,
                                     {0.0, 0.0},
                                     1.0};
}

static void test_matrix(void **state)
{
    struct chart_case k;
    struct chart_fit fit;
    struct rng rng;
    double product[9] = {0};
    (void)state;
    rng_start(&rng, &(struct rng_key){.seed = 1}, 0, 0);
    make_case(&k, &rng, 0.15, 2.0, 0.05, 0.0, 0.0);
    assert_int_equal(chart_fit_patches(&k.list, &fit, NULL), STATUS_OK);
    for (size_t i = 0; i < 27; i++)
        product[i / 9 * 3 + i % 3] += fit.matrix[i / 9 * 3 + i / 3 % 3] * camera[i / 3 % 3 * 3 + i % 3];
    for (size_t i = 0; i < 9; i++) assert_true(fabs(product[i] - (i % 4 == 0 ? 1.0 : 0.0)) < 1e-6);
    for (size_t i = 0; i < 24; i++)
        assert_true(fabs(chart_fit_light(&fit, k.place[i]) - light_at(k.place[i], 0.15, 2.0, 0.05)) < 1e-6);
    k.list.scale_at[0] = 0.8; /* the scale moves with the place of the cloth */
    k.list.scale_at[1] = -0.3;
    const double light = light_at(k.list.scale_at, 0.15, 2.0, 0.05), first = fit.matrix[0];
    assert_int_equal(chart_fit_patches(&k.list, &fit, NULL), STATUS_OK);
    assert_true(fabs(fit.matrix[0] * light / first - 1.0) < 1e-6);
    for (size_t i = 0; i < 24; i++)
        for (size_t c = 0; c < 3; c++) k.measured[i][c] = 0.1 * (double)i + 0.1;
    assert_int_equal(chart_fit_patches(&k.list, &fit, NULL), STATUS_NUMERIC);
    k.list.n = 7;
    assert_int_equal(chart_fit_patches(&k.list, &fit, NULL), STATUS_NUMERIC);
}

/* Lamps that fall by 5 to 30 % in any direction, bent or not, over charts whose own colors are wrong by 0 or 1 %:
 * radiances of cards at the place of the scale are right within their errors, whose scatter over the charts is 1. */
static void test_errors_of_the_matrix(void **state)
{
    enum { N_DRAW = 300, CARDS = 4 };
    static const double card_rgb[CARDS][3] = {{0.9, 0.3, 0.1}, {0.05, 0.06, 0.2}, {0.05, 0.1, 0.4}, {0.3, 0.3, 0.3}};
    static const struct {
        double fall, bend, noise, reference;
    } kind[] = {{0.0, 0.0, 0.003, 0.0},
                {0.05, 0.0, 0.003, 0.0},
                {0.2, 0.04, 0.003, 0.0},
                {0.3, 0.0, 0.001, 0.01},
                {0.2, 0.05, 0.001, 0.01}};
    (void)state;
    for (size_t t = 0; t < sizeof kind / sizeof *kind; t++) {
        double square = 0.0, worst = 0.0, relative = 0.0;
        struct rng rng;
        rng_start(&rng, &(struct rng_key){.seed = 3 + t}, 0, 0);
        for (size_t draw = 0; draw < N_DRAW; draw++) {
            struct chart_case k;
            struct chart_fit fit;
            make_case(&k, &rng, kind[t].fall / (2.0 - kind[t].fall), 0.1 * (double)draw, kind[t].bend, kind[t].noise,
                      kind[t].reference);
            assert_int_equal(chart_fit_patches(&k.list, &fit, NULL), STATUS_OK);
            for (size_t i = 0; i < CARDS; i++) {
                double in[3], out[3], error[3][COLOR_MATRIX_CAUSES];
                color_matrix_apply(camera, card_rgb[i], in);
                color_matrix_apply(fit.matrix, in, out);
                color_matrix_error(fit.cov, in, error);
                for (size_t c = 0; c < 3; c++) {
                    double var = 0.0, off = out[c] - card_rgb[i][c];
                    for (size_t e = 0; e < COLOR_MATRIX_CAUSES; e++) var += error[c][e] * error[c][e];
                    square += off * off / var / (3 * CARDS * N_DRAW);
                    worst = fmax(worst, fabs(off) / sqrt(var));
                    relative += off * off / (card_rgb[i][c] * card_rgb[i][c]) / (3 * CARDS * N_DRAW);
                }
            }
        }
        print_message("fall %g bend %g noise %g reference %g: z %.2f, largest %.1f; relative error %.4f\n",
                      kind[t].fall, kind[t].bend, kind[t].noise, kind[t].reference, sqrt(square), worst,
                      sqrt(relative));
        assert_true(sqrt(square) > 0.8 && sqrt(square) < 1.25 && worst < 7.0);
        assert_true(sqrt(relative) < (kind[t].reference > 0.0 ? 0.03 : 0.01));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_matrix), cmocka_unit_test(test_errors_of_the_matrix)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
