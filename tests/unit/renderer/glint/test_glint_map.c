/* Procedural normal maps: spectra, slopes and interpolation; and one Gaussian element as appendix A of the dissertation
 * has it. */
#include "base/rng.h"
#include "renderer/glint/fourier_grid.h"
#include "renderer/glint/glint_element.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

static struct glint_map map_of(const struct glint_option *given)
{
    struct glint_option o;
    struct glint_map m;
    assert_int_equal(glint_option_complete(given, &o, NULL), STATUS_OK);
    assert_int_equal(glint_map_make(&o, &m, NULL), STATUS_OK);
    return m;
}

/* Slope dh/du or dh/dv of a texel. */
static double slope_of(const struct glint_map *m, size_t i, size_t j, int axis)
{
    const float *n = m->normal[(j & (m->n - 1)) * m->n + (i & (m->n - 1))];
    return -(double)n[axis] / sqrt(1 - (double)n[0] * (double)n[0] - (double)n[1] * (double)n[1]);
}

static void a_transform_matches_its_sum(void **state)
{
    (void)state;
    enum { N = 8 };
    double value[N * N][2], right[N * N][2];
    struct rng r;
    const struct rng_key key = {.seed = 9};
    rng_start(&r, &key, 0, 0);
    for (int sign = -1; sign <= 1; sign += 2) {
        for (int k = 0; k < N * N; k++)
            for (int c = 0; c < 2; c++) value[k][c] = rng_double(&r);
        memset(right, 0, sizeof right);
        for (int k = 0; k < N * N; k++)
            for (int i = 0; i < N * N; i++) {
                const double turn = sign * 2 * M_PI * (i % N * (k % N) + i / N * (k / N)) / N;
                right[k][0] += value[i][0] * cos(turn) - value[i][1] * sin(turn);
                right[k][1] += value[i][0] * sin(turn) + value[i][1] * cos(turn);
            }
        assert_int_equal(fourier_grid_transform(value, N, sign, NULL), STATUS_OK);
        for (int k = 0; k < N * N; k++)
            for (int c = 0; c < 2; c++) assert_true(fabs(value[k][c] - right[k][c]) < 1e-12);
    }
}

/* Correlation of dh/d(axis) along the same axis at a distance of texels. */
static double correlation(const struct glint_map *m, int axis, size_t distance)
{
    double sum = 0, square = 0;
    for (size_t j = 0; j < m->n; j++)
        for (size_t i = 0; i < m->n; i++) {
            const double p = slope_of(m, i, j, axis);
            square += p * p;
            sum += p * slope_of(m, i + (axis == 0 ? distance : 0), j + (axis == 1 ? distance : 0), axis);
        }
    return sum / square;
}

/* h with the correlation exp(-(x / l)^2) has slopes with (1 - 2 x^2 / l^2) exp(-x^2 / l^2). A map of n x n texels has
 * about n^2 / (pi l_u l_v) independent places, so the standard error is below 0.015 and 0.03. */
static void noise_has_its_spectrum(void **state)
{
    (void)state;
    const struct glint_option even = {.seed = 3, .n_texel = 512, .length_um = {4, 4}, .slope = 0.2F};
    const struct glint_option brushed = {.seed = 4, .n_texel = 512, .length_um = {16, 4}, .slope = 0.1F};
    struct glint_map m = map_of(&even);
    double square = 0;
    for (size_t k = 0; k < m.n * m.n; k++)
        for (int a = 0; a < 2; a++) square += pow(slope_of(&m, k % m.n, k / m.n, a), 2) / (double)(m.n * m.n);
    assert_true(fabs(sqrt(square) - 0.2) < 1e-4);
    for (int a = 0; a < 2; a++) {
        assert_true(fabs(correlation(&m, a, 2) - 0.5 * exp(-0.25)) < 0.05);
        assert_true(fabs(correlation(&m, a, 4) + exp(-1)) < 0.05);
    }
    glint_map_release(&m);
    m = map_of(&brushed);
    assert_true(fabs(correlation(&m, 0, 8) - 0.5 * exp(-0.25)) < 0.1);
    assert_true(fabs(correlation(&m, 1, 2) - 0.5 * exp(-0.25)) < 0.1);
    glint_map_release(&m);
}

/* 128 x 128 flakes: Beckmann's tan^2 is exponential with the mean alpha^2, and larger than it with the probability 1/e.
 * The areas of flakes vary, so the standard errors are 1.3 times 1 / 128 and 0.5 / 128. */
static void flakes_have_beckmanns_slopes(void **state)
{
    (void)state;
    const struct glint_option o = {.kind = GLINT_FLAKES, .seed = 8, .n_texel = 512, .flake_um = 4, .slope = 0.3F};
    struct glint_map m = map_of(&o);
    double mean = 0, above = 0, changes = 0;
    for (size_t k = 0; k < m.n * m.n; k++) {
        const size_t i = k % m.n, j = k / m.n;
        const double square = pow(slope_of(&m, i, j, 0), 2) + pow(slope_of(&m, i, j, 1), 2);
        mean += square / (0.09 * (double)(m.n * m.n));
        above += (square > 0.09) / (double)(m.n * m.n);
        changes += (slope_of(&m, i, j, 0) != slope_of(&m, i + 1, j, 0)) / (double)(m.n * m.n);
    }
    print_message("flakes: mean %.4f, above %.4f, edges %.3f\n", mean, above, changes);
    assert_true(fabs(mean - 1) < 4 * 1.3 / 128);
    assert_true(fabs(above - exp(-1)) < 4 * 1.3 * 0.5 / 128);
    assert_true(changes > 0.2 && changes < 0.35); /* a row crosses about one edge in a flake's width of four texels */
    glint_map_release(&m);
}

/* Grooves are as steep as stated within a half, and the surface between them is ten times smoother. */
static void scratches_are_steep_in_a_share(void **state)
{
    (void)state;
    const struct glint_option o = {.kind = GLINT_SCRATCHES, .seed = 8, .n_texel = 256, .scratch_share = 0.1F};
    struct glint_map m = map_of(&o);
    double steep = 0, smooth = 0;
    for (size_t k = 0; k < m.n * m.n; k++) {
        const double slope = hypot(slope_of(&m, k % m.n, k / m.n, 0), slope_of(&m, k % m.n, k / m.n, 1));
        steep += (slope > 0.04) / (double)(m.n * m.n);
        smooth += (slope < 0.025) / (double)(m.n * m.n);
    }
    print_message("scratches: steep %.3f, smooth %.3f\n", steep, smooth);
    assert_true(steep > 0.03 && steep < 0.1);
    assert_true(smooth > 0.85);
    glint_map_release(&m);
}

static void maps_repeat_with_their_seed(void **state)
{
    (void)state;
    for (int k = GLINT_NOISE; k <= GLINT_FLAKES; k++) {
        const struct glint_option o = {.kind = (enum glint_kind)k, .seed = 1, .n_texel = 64},
                                  other = {.kind = (enum glint_kind)k, .seed = 2, .n_texel = 64};
        struct glint_map a = map_of(&o), b = map_of(&o), c = map_of(&other);
        assert_memory_equal(a.normal, b.normal, 64 * 64 * sizeof *a.normal);
        assert_memory_not_equal(a.normal, c.normal, 64 * 64 * sizeof *a.normal);
        /* periodic, the texel at its middle, and a Jacobian as differences have it */
        for (int i = 0; i < 50; i++) {
            const double place[2] = {i * 1.37 + 0.01, i * 0.71 + 0.01}, far[2] = {place[0] - 128, place[1] + 64};
            float n[2], m[2], jacobian[4];
            glint_map_at(&a, place, n, jacobian);
            glint_map_at(&a, far, m, NULL);
            for (int d = 0; d < 2; d++) {
                double at[2] = {place[0], place[1]};
                float up[2], down[2];
                assert_true(fabsf(n[d] - m[d]) < 1e-6F);
                at[d] += 1e-3;
                glint_map_at(&a, at, up, NULL);
                at[d] -= 2e-3;
                glint_map_at(&a, at, down, NULL);
                for (int q = 0; q < 2 && !a.is_flat; q++)
                    assert_true(fabs((double)(up[q] - down[q]) / 2e-3 - (double)jacobian[2 * q + d]) < 2e-4);
            }
            const double middle[2] = {i + 0.5, 2.5};
            glint_map_at(&a, middle, n, NULL);
            for (int d = 0; d < 2; d++) assert_true(fabsf(n[d] - a.normal[2 * 64 + i][d]) < 1e-7F);
        }
        glint_map_release(&a);
        glint_map_release(&b);
        glint_map_release(&c);
    }
}

/* The integral of G_p G_i over u by equations 3.26 and A.1 to A.7, in the element's coordinates. j: its Jacobian; p:
 * the footprint's middle; s: the normal. */
static double appendix_a(const double j[4], const double cov_p[3], const double p[2], const double s[2],
                         const double variance[2])
{
    const double h2 = variance[0], r2 = variance[1], c = 2 * log(2) / (M_PI * M_PI * r2);
    const double a[3] = {1 / h2 + (j[0] * j[0] + j[2] * j[2]) / r2, (j[0] * j[1] + j[2] * j[3]) / r2,
                         1 / h2 + (j[1] * j[1] + j[3] * j[3]) / r2};
    const double det_a = a[0] * a[2] - a[1] * a[1];
    /* -B s, with B = -J^T / r2 */
    const double bs[2] = {(j[0] * s[0] + j[2] * s[1]) / r2, (j[1] * s[0] + j[3] * s[1]) / r2};
    const double u0[2] = {(a[2] * bs[0] - a[1] * bs[1]) / det_a, (a[0] * bs[1] - a[1] * bs[0]) / det_a};
    const double c1 = c * exp(-((s[0] * s[0] + s[1] * s[1]) / r2 -
                                (a[0] * u0[0] * u0[0] + 2 * a[1] * u0[0] * u0[1] + a[2] * u0[1] * u0[1])) /
                              2);
    const double det_p = cov_p[0] * cov_p[2] - cov_p[1] * cov_p[1];
    const double q[3] = {cov_p[2] / det_p, -cov_p[1] / det_p, cov_p[0] / det_p};
    /* the product with the footprint: precisions add up */
    const double m[3] = {a[0] + q[0], a[1] + q[1], a[2] + q[2]}, det_m = m[0] * m[2] - m[1] * m[1];
    const double b[2] = {a[0] * u0[0] + a[1] * u0[1] + q[0] * p[0] + q[1] * p[1],
                         a[1] * u0[0] + a[2] * u0[1] + q[1] * p[0] + q[2] * p[1]};
    const double mu[2] = {(m[2] * b[0] - m[1] * b[1]) / det_m, (m[0] * b[1] - m[1] * b[0]) / det_m};
    const double d[2] = {mu[0] - u0[0], mu[1] - u0[1]}, e[2] = {mu[0] - p[0], mu[1] - p[1]};
    const double peak = exp(-(a[0] * d[0] * d[0] + 2 * a[1] * d[0] * d[1] + a[2] * d[1] * d[1] + q[0] * e[0] * e[0] +
                              2 * q[1] * e[0] * e[1] + q[2] * e[1] * e[1]) /
                            2);
    return c1 / (2 * M_PI * sqrt(det_p)) * peak * 2 * M_PI / sqrt(det_m);
}

/* The sum of the elements' weights under a footprint, one by one. */
static double weight_sum(const struct glint_query *q, double h)
{
    const double det = (double)(q->wide[0] * q->wide[2] - q->wide[1] * q->wide[1]);
    double sum = 0;
    for (int i = -80; i < 80; i++)
        for (int k = -80; k < 80; k++) {
            const double d[2] = {(i + 0.5) * h - (double)q->center_um[0], (k + 0.5) * h - (double)q->center_um[1]};
            sum += h * h / (2 * M_PI * sqrt(det)) *
                   exp(-((double)q->inverse[0] * d[0] * d[0] + 2 * (double)q->inverse[1] * d[0] * d[1] +
                         (double)q->inverse[2] * d[1] * d[1]) /
                       2);
        }
    return sum;
}

static void an_element_matches_appendix_a(void **state)
{
    (void)state;
    struct rng r;
    const struct rng_key key = {.seed = 4};
    const float h = 1.5F, r2 = 1e-4F;
    const struct glint_lattice l = {
        .n = 64, .step_um = h, .period_um = 96, .variance_h = h * h / (8 * logf(2)), .variance_r = r2};
    rng_start(&r, &key, 0, 0);
    for (int k = 0; k < 200; k++) {
        struct glint_element e = {{20, 30}, {0.1F, -0.05F}, {0}};
        const float wide = (float)exp(4 * rng_double(&r) - 3), narrow = wide * (0.1F + rng_float(&r));
        const struct glint_footprint f = {{20 + 2 * (rng_float(&r) - 0.5F), 30 + 2 * (rng_float(&r) - 0.5F)},
                                          {wide, 0.2F * narrow, narrow}};
        const uint32_t index = 0;
        const float no_shift[2] = {0, 0};
        struct glint_query q;
        float half[2];
        double j[4], s[2], d[2], cov[3];
        for (int c = 0; c < 4; c++) j[c] = (double)(e.jacobian[c] = 0.04F * (rng_float(&r) - 0.5F));
        for (int c = 0; c < 2; c++) {
            half[c] = e.normal[c] + 0.03F * (rng_float(&r) - 0.5F);
            s[c] = (double)(half[c] - e.normal[c]);
            d[c] = (double)(f.center_um[c] - e.place_um[c]);
        }
        for (int c = 0; c < 3; c++) cov[c] = (double)f.covariance_um2[c];
        const double variance[2] = {(double)l.variance_h, (double)r2};
        glint_query_init(&l, &f, &q);
        const double mine =
            (double)(q.factor * glint_query_sum(&q, &e, &index, 1, no_shift, half)) * weight_sum(&q, (double)h);
        const double right = appendix_a(j, cov, d, s, variance);
        assert_true(fabs(mine - right) < 1e-4 * right + 1e-9);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_transform_matches_its_sum),  cmocka_unit_test(noise_has_its_spectrum),
        cmocka_unit_test(flakes_have_beckmanns_slopes), cmocka_unit_test(scratches_are_steep_in_a_share),
        cmocka_unit_test(maps_repeat_with_their_seed),  cmocka_unit_test(an_element_matches_appendix_a),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
