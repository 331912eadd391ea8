/* Roughened fibers: the stated noise of direction is added, nothing without noise, and the same waves at any size. */
#include "geometry/fibers/shape/fiber_roughen.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

enum { N_FIBER = 20, N_VERTEX = 800 };
static const double spacing_m = 1e-6, length_m = 4e-6;

/* Straight fibers along x. */
static void make_fibers(struct fiber_set *f)
{
    fiber_set_init(f);
    assert_int_equal(fiber_set_reserve(f, N_FIBER, N_FIBER * N_VERTEX, NULL), STATUS_OK);
    f->tile_size_m[0] = f->tile_size_m[1] = N_VERTEX * spacing_m;
    for (size_t i = 0; i < N_FIBER; i++) {
        f->first_vertex[i + 1] = (i + 1) * N_VERTEX;
        f->radius_m[i] = 7e-6f;
        for (size_t k = 0; k < N_VERTEX; k++) {
            float *p = f->position_m + 3 * (i * N_VERTEX + k);
            p[0] = (float)((double)k * spacing_m);
            p[1] = p[2] = (float)((double)i * 30e-6);
        }
    }
}

/* RMS of one component of the direction across x. */
static double direction_sd(const struct fiber_set *f)
{
    double square = 0.0, n = 0.0;
    for (size_t i = 0; i < f->n_fiber; i++)
        for (size_t v = f->first_vertex[i]; v + 1 < f->first_vertex[i + 1]; v++, n += 2.0) {
            const float *a = f->position_m + 3 * v, *b = a + 3;
            for (int c = 1; c < 3; c++) square += pow((double)(b[c] - a[c]) / spacing_m, 2.0);
        }
    return sqrt(square / n);
}

static void test_noise_is_as_stated(void **state)
{
    (void)state;
    for (int k = 1; k <= 2; k++) {
        struct fiber_set f;
        const struct fiber_roughness r = {length_m, 0.02 * k};
        make_fibers(&f);
        fiber_roughen(&f, &r);
        double sd = direction_sd(&f);
        print_message("direction %.4f, stated %.4f\n", sd, r.direction_sd_rad);
        assert_true(fabs(sd / r.direction_sd_rad - 1.0) < 0.05);
        fiber_set_release(&f);
    }
}

static void test_without_noise(void **state)
{
    (void)state;
    struct fiber_set f, same;
    make_fibers(&f);
    fiber_set_init(&same);
    assert_int_equal(fiber_set_copy(&f, &same, NULL), STATUS_OK);
    fiber_roughen(&same, &(struct fiber_roughness){length_m, 0.0});
    assert_memory_equal(same.position_m, f.position_m, 3 * f.n_vertex * sizeof *f.position_m);
    assert_memory_equal(same.radius_m, f.radius_m, f.n_fiber * sizeof *f.radius_m);
    fiber_set_release(&same);
    fiber_set_release(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_noise_is_as_stated),
        cmocka_unit_test(test_without_noise),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
