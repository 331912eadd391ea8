/* A described cloth does not depend on the size of its tile: where staples end, and how far yarns wander. */
#include "geometry/cloth/cloth.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static void set_number(struct cloth_description *d, const char *name, double value)
{
    int i = cloth_number_index(d, name);
    assert_true(i >= 0);
    d->number[i].value = value;
}

static void build_plain(size_t n_yarn, size_t n_fiber, double disorder, uint64_t seed, struct fiber_set *f,
                        struct cloth_report *r)
{
    struct cloth_description d;
    struct error err = {0};
    assert_int_equal(cloth_description_init(&d, "plain", &err), STATUS_OK);
    d.seed = seed;
    d.kind[0].n_fiber = n_fiber;
    d.n_yarn[0] = d.n_yarn[1] = n_yarn;
    set_number(&d, "cover_warp", 0.6);
    set_number(&d, "cover_weft", 0.6);
    set_number(&d, "disorder", disorder);
    set_number(&d, "yarns[0].fiber_angle_deg", 0.0);
    set_number(&d, "yarns[0].hairs_per_mm", 0.0);
    fiber_set_init(f);
    if (cloth_build(&d, NULL, NULL, NULL, f, r, &err) != STATUS_OK) fail_msg("%s: %s", err.field, err.text);
}

/* Distance along x between two places of a tile, the shorter way around. */
static double apart_m(double a_m, double b_m, double tile_m) { return fabs(remainder(a_m - b_m, tile_m)); }

/* Places in a section turn with the twist, and a tile seldom holds whole turns. So fibers that begin do not fit
 * those that end, and both are in a section only along the seam of the yarn, whose length does not depend on the
 * tile (cloth_yarn.c). Of each weft, all ends lie within it of each other; 2 radii more for bends. */
static void test_staples_end_together(void **state)
{
    enum { N_YARN = 8, N_FIBER = 30 };
    static const double seam_radii = 24.0 + 2.0;
    (void)state;
    struct fiber_set f;
    struct cloth_report r;
    size_t n_end[N_YARN] = {0};
    double first_m[N_YARN], far_m = 0.0;
    build_plain(N_YARN, N_FIBER, 0.0, 1, &f, &r);
    for (size_t i = 0; i < f.n_fiber; i++)
        for (int end = 0; end < 2 && f.axis_class[i] == 0; end++) {
            const float *p = f.position_m + 3 * (end == 0 ? f.first_vertex[i] : f.first_vertex[i + 1] - 1);
            double x_m = (double)p[0], face_m = fmin(fabs(x_m), fabs(x_m - r.tile_m[0]));
            size_t yarn = (size_t)floor((double)p[1] / r.yarn_spacing_m[1]) % N_YARN;
            if (face_m < (double)f.radius_m[i]) continue; /* it goes on in the next tile */
            if (n_end[yarn]++ == 0) first_m[yarn] = x_m;
            far_m = fmax(far_m, apart_m(x_m, first_m[yarn], r.tile_m[0]) / (double)f.radius_m[i]);
        }
    for (size_t y = 0; y < N_YARN; y++) assert_true(n_end[y] > N_FIBER);
    printf("ends of a yarn are up to %.1f radii apart\n", far_m);
    assert_true(far_m < seam_radii);
    fiber_set_release(&f);
}

/* Mean square of the sine of the sideways angle of warps. */
static double slope_square(size_t n_yarn, uint64_t seed)
{
    struct fiber_set f;
    struct cloth_report r;
    double square = 0.0, length = 0.0;
    build_plain(n_yarn, 1, 0.1, seed, &f, &r);
    for (size_t i = 0; i < f.n_fiber; i++)
        for (size_t k = f.first_vertex[i]; f.axis_class[i] == 1 && k + 1 < f.first_vertex[i + 1]; k++) {
            const float *a = f.position_m + 3 * k, *b = a + 3;
            double step[3] = {(double)(b[0] - a[0]), (double)(b[1] - a[1]), (double)(b[2] - a[2])};
            double step_m = hypot(hypot(step[0], step[1]), step[2]);
            square += step_m > 0.0 ? step[0] * step[0] / step_m : 0.0;
            length += step_m;
        }
    fiber_set_release(&f);
    return square / length;
}

/* Disorder means the same cloth in tiles of 16 and 48 yarns. Waves that grow with the tile would have a ninth of the
 * square of the slope. Logarithms over seeds, four standard errors of their difference. */
static void test_disorder_does_not_depend_on_the_tile(void **state)
{
    enum { N_SEED = 4 };
    static const size_t n_yarn[2] = {16, 48};
    (void)state;
    double mean[2] = {0.0, 0.0}, value[2][N_SEED], variance = 0.0;
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < N_SEED; i++) {
            value[k][i] = log(slope_square(n_yarn[k], 1 + (uint64_t)i));
            mean[k] += value[k][i] / N_SEED;
        }
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < N_SEED; i++) variance += pow(value[k][i] - mean[k], 2.0) / (N_SEED * (N_SEED - 1));
    printf("slopes of 48 yarns over those of 16: %.3f +- %.3f in the square\n", exp(mean[1] - mean[0]), sqrt(variance));
    assert_true(fabs(mean[1] - mean[0]) < 4.0 * sqrt(variance) && sqrt(variance) < 0.25);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_staples_end_together),
        cmocka_unit_test(test_disorder_does_not_depend_on_the_tile),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
