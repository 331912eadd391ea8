/* The misfit as a smooth field over directions: found where it is there, not found in independent errors, and known
 * beside fitted rows only. */
#include "base/angle.h"
#include "base/rng.h"
#include "optimizer/fit/objective/misfit_field.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { ROWS = 48 };

struct rows {
    struct observation item[ROWS];
    struct observation_set o;
    struct estimate e[ROWS];
    struct misfit_field field;
};

static struct configuration seen_from(double light, double camera, double azimuth, bool all)
{
    return (struct configuration){.light_theta_rad = light * RAD_PER_DEG,
                                  .camera_theta_rad = camera * RAD_PER_DEG,
                                  .camera_phi_rad = azimuth * RAD_PER_DEG,
                                  .n_rotation = all ? CONFIGURATION_ALL_ROTATIONS : 0};
}

/* Light and camera at 10 to 50 degrees, azimuths 0 to 75. error: relative, of row i. */
static struct rows *make_rows(double (*error)(size_t i, const struct configuration *c), double misfit_var, bool all)
{
    struct rows *r = calloc(1, sizeof *r);
    assert_non_null(r);
    r->o = (struct observation_set){.n = ROWS, .item = r->item};
    for (size_t i = 0; i < ROWS; i++) {
        r->item[i].weight = 1.0;
        r->item[i].configuration =
            seen_from(10.0 + 10.0 * (double)(i % 4), 15.0 + 10.0 * (double)(i / 4 % 3), 25.0 * (double)(i / 12), all);
        for (int c = 0; c < 3; c++) {
            r->item[i].mean_rgb[c] = 0.2;
            r->e[i].mean[c] = 0.2 * (1.0 + error(i, &r->item[i].configuration));
        }
    }
    misfit_field_init(&r->field, &r->o, r->e, r->e, misfit_var);
    return r;
}

static double smooth(size_t i, const struct configuration *c)
{
    (void)i;
    return 0.15 * cos(4.0 * c->light_theta_rad) * cos(3.0 * c->camera_theta_rad + c->camera_phi_rad);
}

static double independent(size_t i, const struct configuration *c)
{
    const struct rng_key key = {.seed = 3};
    struct rng rng;
    double normal[2];
    (void)c;
    rng_start(&rng, &key, (uint32_t)i, 0);
    rng_normal_pair(&rng, normal);
    return 0.1 * normal[0];
}

static double predicted(const struct rows *r, const struct configuration *c)
{
    struct misfit_prediction p;
    misfit_field_predict(&r->field, c, &p);
    assert_true(p.smooth_var >= 0.0 && p.rest_var >= 0.0);
    assert_true(p.smooth_var + p.rest_var <= r->field.misfit_var * (1.0 + 1e-9));
    return p.smooth_var;
}

static void test_smooth_misfit(void **state)
{
    (void)state;
    struct rows *r = make_rows(smooth, 0.01, false);
    const struct configuration beside = seen_from(22.0, 26.0, 24.0, false), far = seen_from(70.0, 70.0, 165.0, false);
    print_message("smooth: share %.1f, length %.2f; variance beside a row %.2g, far from all %.2g\n",
                  r->field.smooth_share, r->field.length, predicted(r, &beside), predicted(r, &far));
    assert_true(r->field.smooth_share >= 0.6 && r->field.length >= 0.3);
    assert_true(predicted(r, &far) > 20.0 * predicted(r, &beside));
    assert_true(predicted(r, &far) > 0.5 * 0.01 * r->field.smooth_share);
    free(r);
}

static void test_independent_misfit(void **state)
{
    (void)state;
    struct rows *r = make_rows(independent, 0.01, false);
    const struct configuration far = seen_from(70.0, 70.0, 165.0, false);
    struct misfit_prediction p;
    misfit_field_predict(&r->field, &far, &p);
    print_message("independent: share %.1f\n", r->field.smooth_share);
    assert_true(r->field.smooth_share == 0.0 && p.smooth_var == 0.0 && fabs(p.rest_var - 0.01) < 1e-12);
    free(r);
}

/* Rows over all rotations of the cloth are the same when light and camera turn together or are mirrored. */
static void test_rotations(void **state)
{
    (void)state;
    struct rows *r = make_rows(smooth, 0.01, true);
    struct configuration a = seen_from(60.0, 55.0, 130.0, true), turned = a, mirrored = a;
    turned.light_phi_rad += 1.0;
    turned.camera_phi_rad += 1.0;
    mirrored.camera_phi_rad = -a.camera_phi_rad;
    assert_true(r->field.n == ROWS && predicted(r, &a) > 0.0);
    assert_true(fabs(predicted(r, &turned) - predicted(r, &a)) < 1e-9);
    assert_true(fabs(predicted(r, &mirrored) - predicted(r, &a)) < 1e-9);
    free(r);
}

static void test_few_rows_or_no_misfit(void **state)
{
    (void)state;
    struct rows *r = make_rows(smooth, 0.0, false);
    const struct configuration far = seen_from(70.0, 70.0, 165.0, false);
    assert_true(r->field.n == 0 && predicted(r, &far) == 0.0);
    r->o.n = 5;
    misfit_field_init(&r->field, &r->o, r->e, r->e, 0.01);
    assert_true(r->field.n == 0 && predicted(r, &far) == 0.0);
    free(r);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_smooth_misfit), cmocka_unit_test(test_independent_misfit),
                                       cmocka_unit_test(test_rotations), cmocka_unit_test(test_few_rows_or_no_misfit)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
