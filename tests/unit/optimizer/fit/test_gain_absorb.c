/* Gains of photographs that are taken out of a linear model, against the matrix of linear_model.h:
 * T = sqrt(v) (v I + gain_sd^2 m m')^(-1/2), with m = sqrt(w) M and v the row's noise and the misfit that is left. */
#include "base/rng.h"
#include "optimizer/fit/linear/linear_gain.h"
#include "optimizer/fit/objective/objective.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

enum { N = 5, ROWS = 3 * N, PARAMS = 2, CONTRAST = 2, DARK = 3 };

static void make(struct linear_model *m, struct observation item[N], uint64_t seed)
{
    struct rng rng;
    rng_start(&rng, &(struct rng_key){.seed = seed}, 0, 0);
    assert_int_equal(linear_model_init(m, ROWS, PARAMS, NULL), STATUS_OK);
    m->gain_sd = 0.1;
    for (size_t i = 0; i < N; i++) {
        item[i] = (struct observation){.weight = i == 1 ? 2.0 : 1.0};
        for (size_t c = 0; c < 3; c++) item[i].mean_rgb[c] = i == DARK ? 0.0 : 0.1 + rng_double(&rng);
        if (i == CONTRAST) item[i].configuration.contrast_cells = 4;
    }
    for (size_t row = 0; row < ROWS; row++) {
        const double r = 0.1 * (rng_double(&rng) - 0.4);
        for (size_t k = 0; k < LINEAR_COLOR_CAUSES; k++)
            m->color[row * LINEAR_COLOR_CAUSES + k] = rng_double(&rng) - 0.5;
        for (int q = 0; q < 2; q++) {
            m->r[q][row] = r + 0.02 * (rng_double(&rng) - 0.5);
            m->r_var[q][row] = 1e-4 * (1.0 + rng_double(&rng));
            for (size_t p = 0; p < PARAMS; p++) {
                m->j[q][row * PARAMS + p] = rng_double(&rng) - 0.5;
                m->j_var[q][row * PARAMS + p] = 0.01 * rng_double(&rng);
            }
        }
    }
}

/* T of configuration i: the identity but along m, where it is 1 / sqrt(1 + gain_sd^2 |m|^2 / v). */
static void transform(const struct linear_model *m, const struct observation *item, size_t i, double misfit,
                      double t[3][3])
{
    double length2 = 0.0, noise = 0.0;
    for (size_t c = 0; c < 3; c++) {
        length2 += objective_weight(&item[i]) * item[i].mean_rgb[c] * item[i].mean_rgb[c];
        noise += (m->r_var[0][3 * i + c] + m->r_var[1][3 * i + c]) / 12.0;
    }
    const double along = 1.0 / sqrt(1.0 + m->gain_sd * m->gain_sd * length2 / (misfit + noise));
    for (size_t a = 0; a < 3; a++)
        for (size_t b = 0; b < 3; b++) {
            const double uu = objective_weight(&item[i]) * item[i].mean_rgb[a] * item[i].mean_rgb[b] / length2;
            t[a][b] = a == b;
            if (i != CONTRAST && i != DARK) t[a][b] -= (1.0 - along) * uu;
        }
}

/* Mean product of the replicas of the rows of means, as they are or after T. */
static double mean_product(const struct linear_model *m, const struct observation *item, double misfit, bool absorbed)
{
    double sum = 0.0;
    for (size_t i = 0; i < N; i++) {
        double t[3][3];
        transform(m, item, i, misfit, t);
        for (size_t a = 0; a < 3 && i != CONTRAST; a++) {
            double left = absorbed ? 0.0 : m->r[0][3 * i + a], right = absorbed ? 0.0 : m->r[1][3 * i + a];
            for (size_t b = 0; b < 3 && absorbed; b++) {
                left += t[a][b] * m->r[0][3 * i + b];
                right += t[a][b] * m->r[1][3 * i + b];
            }
            sum += left * right / (3.0 * (N - 1));
        }
    }
    return fmax(sum, 1e-8);
}

static void assert_near(double got, double want, const char *what)
{
    if (!(fabs(got - want) <= 1e-9 * fabs(want) + 1e-12)) fail_msg("%s: %.12g, not %.12g", what, got, want);
}

/* Three values `stride` apart, before and after. */
static void check_values(const double *before, const double *after, size_t stride, double t[3][3], const char *what)
{
    for (size_t a = 0; a < 3; a++) {
        double want = 0.0;
        for (size_t b = 0; b < 3; b++) want += t[a][b] * before[b * stride];
        assert_near(after[a * stride], want, what);
    }
}

static void check_variances(const double *before, const double *after, size_t stride, double t[3][3], const char *what)
{
    for (size_t a = 0; a < 3; a++) {
        double apart = 0.0, together = 0.0;
        for (size_t b = 0; b < 3; b++) {
            apart += t[a][b] * t[a][b] * before[b * stride];
            together += t[a][b] * sqrt(before[b * stride]);
        }
        assert_near(after[a * stride], fmax(apart, together * together), what);
    }
}

static void check(const struct linear_model *before, const struct linear_model *after, size_t i, double t[3][3])
{
    const size_t row = 3 * i;
    for (size_t k = 0; k < LINEAR_COLOR_CAUSES; k++)
        check_values(before->color + row * LINEAR_COLOR_CAUSES + k, after->color + row * LINEAR_COLOR_CAUSES + k,
                     LINEAR_COLOR_CAUSES, t, "color");
    for (int q = 0; q < 2; q++) {
        check_values(before->r[q] + row, after->r[q] + row, 1, t, "residual");
        check_variances(before->r_var[q] + row, after->r_var[q] + row, 1, t, "variance");
        for (size_t p = 0; p < PARAMS; p++) {
            const size_t at = row * PARAMS + p;
            check_values(before->j[q] + at, after->j[q] + at, PARAMS, t, "derivative");
            check_variances(before->j_var[q] + at, after->j_var[q] + at, PARAMS, t, "its variance");
        }
    }
}

static void test_against_the_matrix(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= 6; seed++) {
        struct linear_model before, after;
        struct observation item[N];
        struct observation_set o = {.n = N, .item = item};
        make(&before, item, seed);
        make(&after, item, seed);
        linear_gain_absorb(&after, &o);
        double misfit = mean_product(&before, item, 1.0, false);
        for (int round = 0; round < 6; round++) misfit = mean_product(&before, item, misfit, true);
        for (size_t i = 0; i < N; i++) {
            double t[3][3];
            transform(&before, item, i, misfit, t);
            check(&before, &after, i, t);
        }
        linear_model_release(&before);
        linear_model_release(&after);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_against_the_matrix)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
