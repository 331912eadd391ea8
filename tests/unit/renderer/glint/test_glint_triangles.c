/* The triangulated reference against sums over places, and Gaussian elements against it. */
#include "base/rng.h"
#include "renderer/glint/glint_surface.h"
#include "renderer/glint/glint_triangles.h"
#include "renderer/glint/triangle_gaussian.h"
#include "tests/support/glint/glint_binning.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

/* The integral by n x n middles of squares; those that the longest side cuts count as half. */
static double triangle_sum(const struct glint_triangle *t, const struct triangle_query *q, int n)
{
    double sum = 0;
    for (int j = 0; j < n; j++)
        for (int i = 0; i + j < n; i++) {
            const bool cut = i + j == n - 1;
            const double x = (i + (cut ? 1.0 / 3 : 0.5)) / n, y = (j + (cut ? 1.0 / 3 : 0.5)) / n;
            const double d[2] = {t->corner[0] + x * t->leg[0] - q->center[0],
                                 t->corner[1] + y * t->leg[1] - q->center[1]};
            double e = q->inverse[0] * d[0] * d[0] + 2 * q->inverse[1] * d[0] * d[1] + q->inverse[2] * d[1] * d[1];
            for (int c = 0; c < 2; c++) {
                const double s = t->normal[0][c] + x * (t->normal[1][c] - t->normal[0][c]) +
                                 y * (t->normal[2][c] - t->normal[0][c]) - q->half[c];
                e += s * s / q->variance_r;
            }
            sum += (cut ? 0.5 : 1) * exp(-e / 2);
        }
    return sum * fabs(t->leg[0] * t->leg[1]) / (n * n);
}

/* Errors of the sum are of order (width of a square / width of the Gaussian)^2 / 24: 1e-4 at 400 squares. */
static void triangles_match_sums(void **state)
{
    (void)state;
    struct rng r;
    const struct rng_key key = {.seed = 3};
    rng_start(&r, &key, 0, 0);
    double most = 0;
    for (int k = 0; k < 40; k++) {
        struct glint_triangle t = {{rng_double(&r), rng_double(&r)}, {k % 2 ? 1 : -0.25, k % 3 ? 1 : -0.25}, {{0}}};
        struct triangle_query q = {{rng_double(&r), rng_double(&r)}, {0}, {0.02, 0.01}, 0.005 * 0.005};
        const double wide = exp(6 * rng_double(&r) - 3), lean = rng_double(&r) - 0.5;
        q.inverse[0] = 1 / wide;
        q.inverse[1] = lean;
        q.inverse[2] = (1 + lean * lean) * wide;
        for (int i = 0; i < 6; i++) t.normal[i / 2][i % 2] = 0.04 * rng_double(&r) * (k % 5 == 0 ? 0.01 : 1);
        const double sum = triangle_sum(&t, &q, 400), closed = triangle_gaussian(&t, &q);
        const double error = fabs(closed - sum) / (sum + 1e-9);
        most = fmax(most, error);
        assert_true(error < 1e-3);
    }
    print_message("largest relative error of triangles %.2g\n", most);
}

/* Root mean square of differences from the reference with 32 triangles a texel, over the reference's. */
static double difference(const struct glint_option *given, size_t n_split, const struct glint_footprint *f)
{
    struct glint_option o;
    struct glint_map m;
    struct glint_triangles reference, coarse = {0};
    struct glint_surface *s = NULL;
    double square = 0, whole = 0;
    assert_int_equal(glint_option_complete(given, &o, NULL), STATUS_OK);
    assert_int_equal(glint_map_make(&o, &m, NULL), STATUS_OK);
    assert_int_equal(glint_triangles_make(&m, m.is_flat ? 1 : 4, o.roughness, &reference, NULL), STATUS_OK);
    if (n_split > 0)
        assert_int_equal(glint_triangles_make(&m, n_split, o.roughness, &coarse, NULL), STATUS_OK);
    else
        assert_int_equal(glint_surface_new(&o, &s, NULL), STATUS_OK);
    for (int k = 0; k < 12 * 12; k++) {
        const float half[2] = {((float)(k % 12) - 5.5F) * 0.02F, ((float)(k / 12) - 5.5F) * 0.02F};
        const double right = glint_triangles_density(&reference, f, half);
        const double other =
            n_split > 0 ? glint_triangles_density(&coarse, f, half) : (double)glint_density(s, f, half);
        square += (other - right) * (other - right);
        whole += right * right;
    }
    glint_triangles_release(&reference);
    glint_triangles_release(&coarse);
    glint_surface_free(s);
    glint_map_release(&m);
    return sqrt(square / whole);
}

static void elements_match_triangles(void **state)
{
    (void)state;
    const struct glint_option options[] = {
        {.kind = GLINT_NOISE, .seed = 1, .n_texel = 64, .roughness = 0.005F, .step_texel = 0.5F},
        {.kind = GLINT_NOISE, .seed = 1, .n_texel = 64, .roughness = 0.005F},
        {.kind = GLINT_NOISE, .seed = 2, .n_texel = 64, .roughness = 0.01F, .length_um = {60, 8}},
        {.kind = GLINT_SCRATCHES, .seed = 3, .n_texel = 64, .roughness = 0.02F, .step_texel = 0.5F},
        {.kind = GLINT_FLAKES, .seed = 4, .n_texel = 64, .roughness = 0.02F, .step_texel = 0.5F},
    };
    const double bar[] = {0.05, 0.1, 0.1, 0.1, 0.1};
    const struct glint_footprint f = {{20, 30}, {9, 2, 6}};
    for (int k = 0; k < 5; k++) {
        const double d = difference(&options[k], 0, &f);
        print_message("kind %d: elements differ from triangles by %.4f\n", k, d);
        assert_true(d < bar[k]);
    }
    const double coarse = difference(&options[0], 1, &f);
    print_message("2 triangles differ from 32 by %.4f\n", coarse);
    assert_true(coarse < 0.3 && coarse > 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(triangles_match_sums),
        cmocka_unit_test(elements_match_triangles),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
