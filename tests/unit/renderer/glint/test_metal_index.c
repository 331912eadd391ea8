/* Reflectance of metals, and the colors of eight wavelengths. */
#include "renderer/glint/wave_glint.h"
#include "renderer/scattering/fresnel.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void test_conductors_follow_fresnel(void **state)
{
    (void)state;
    const double glass[2] = {1.5, 0};
    for (double c = 0.02; c < 1; c += 0.02) /* without absorption it is a dielectric */
        assert_true(fabs(conductor_reflectance(glass, c) - fresnel_unpolarised(c, 1.5, NULL)) < 1e-12);
    for (int m = 0; m < METAL_N; m++)
        for (double nm = 360; nm <= 830; nm += 10) {
            double a[2];
            metal_index((enum metal)m, nm, a);
            const double normal = (pow(a[0] - 1, 2) + a[1] * a[1]) / (pow(a[0] + 1, 2) + a[1] * a[1]);
            assert_true(fabs(conductor_reflectance(a, 1) - normal) < 1e-12);
            assert_true(fabs(conductor_reflectance(a, 0) - 1) < 1e-12);
        }
}

/* Reflectances of clean films in the literature, within 0.03: silver 0.98 and aluminium 0.91 at 600 nm, gold 0.39 at
 * 450 nm and 0.97 at 700 nm, copper 0.95 at 650 nm. */
static void test_metals_have_their_reflectance(void **state)
{
    (void)state;
    const struct {
        enum metal metal;
        double nm, want;
    } row[] = {{METAL_SILVER, 600, 0.98},
               {METAL_ALUMINIUM, 600, 0.91},
               {METAL_GOLD, 450, 0.39},
               {METAL_GOLD, 700, 0.97},
               {METAL_COPPER, 650, 0.95}};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        double a[2];
        metal_index(row[i].metal, row[i].nm, a);
        assert_true(fabs(conductor_reflectance(a, 1) - row[i].want) < 0.03);
    }
    double rgb[3];
    metal_reflectance_rgb(METAL_GOLD, 1, rgb);
    assert_true(rgb[0] > rgb[1] && rgb[1] > 1.5 * rgb[2]);
    metal_reflectance_rgb(METAL_SILVER, 1, rgb);
    for (int c = 0; c < 3; c++) assert_true(rgb[c] > 0.9 && rgb[c] < 1);
}

static void test_names_are_found(void **state)
{
    (void)state;
    for (int i = 0; i < METAL_N; i++) {
        enum metal m = METAL_N;
        assert_true(metal_find(metal_name((enum metal)i), &m) && m == (enum metal)i);
    }
    for (int i = 0; i < WAVE_N_MODEL; i++) {
        enum wave_model m = WAVE_N_MODEL;
        assert_true(wave_model_find(wave_model_name((enum wave_model)i), &m) && m == (enum wave_model)i);
    }
    enum metal metal;
    enum wave_model model;
    assert_false(metal_find("tin", &metal) || wave_model_find("beckmann", &model));
}

/* Red, green and blue are where the eye sees them; a flat spectrum is white. */
static void test_eight_wavelengths_make_colors(void **state)
{
    (void)state;
    float um[WAVE_N_COLOR], weight[WAVE_N_COLOR][3];
    double sum[3] = {0}, middle[3] = {0};
    wave_glint_colors(um, weight);
    assert_true(fabs((double)um[0] - 0.389375) < 1e-6 && fabs((double)um[7] - 0.800625) < 1e-6);
    for (int i = 0; i < WAVE_N_COLOR; i++)
        for (int c = 0; c < 3; c++) {
            sum[c] += (double)weight[i][c];
            middle[c] += (double)(weight[i][c] * um[i]);
        }
    for (int c = 0; c < 3; c++) assert_true(fabs(sum[c] - 1) < 1e-6);
    assert_true(middle[0] > middle[1] && middle[1] > middle[2]);
    assert_true(middle[2] > 0.43 && middle[2] < 0.48 && middle[1] > 0.52 && middle[1] < 0.57);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_conductors_follow_fresnel),
        cmocka_unit_test(test_metals_have_their_reflectance),
        cmocka_unit_test(test_names_are_found),
        cmocka_unit_test(test_eight_wavelengths_make_colors),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
