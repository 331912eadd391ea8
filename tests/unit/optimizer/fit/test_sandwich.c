/* The errors of parameters against the formulas of uncertainty.h, written down with the whole covariance matrix of the
 * residuals, on random linear models: means, contrasts and expected rows, extra weights, a pair of configurations that
 * share paths, a color matrix with an error, priors, a fixed parameter. */
#include "base/rng.h"
#include "base/small_matrix.h"
#include "optimizer/fit/linear/uncertainty.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

enum { CONFIGURATIONS = 6, ROWS = 3 * CONFIGURATIONS, PARAMS = 4, FREE = 3, FIXED = 1 };
static const size_t moving[FREE] = {0, 2, 3};
static const bool fixed[PARAMS] = {[FIXED] = true};
static const struct param_info info[PARAMS] = {{.lower = 0.01, .upper = 0.99, .start = 0.4, .coordinate = PARAM_LOGIT},
                                               {.lower = 0.0, .upper = 1.0, .start = 0.5, .coordinate = PARAM_LINEAR},
                                               {.lower = -2.0, .upper = 3.0, .start = 0.5, .coordinate = PARAM_LINEAR},
                                               {.lower = 1.0, .upper = 50.0, .start = 7.0, .coordinate = PARAM_LOG}};

struct setting {
    struct linear_model m;
    struct coordinate k[PARAMS];
    struct gaussian_prior prior[PARAMS];
};

static void make(struct setting *s, uint64_t seed, bool has_prior)
{
    struct rng rng;
    struct linear_model *m = &s->m;
    rng_start(&rng, &(struct rng_key){.seed = seed}, 0, 0);
    assert_int_equal(linear_model_init(m, ROWS, PARAMS, NULL), STATUS_OK);
    for (size_t p = 0; p < PARAMS; p++) {
        coordinate_init(&s->k[p], &info[p], info[p].lower, info[p].upper);
        m->x_ref[p] = coordinate_from_param(&s->k[p], info[p].start);
        s->prior[p] = (struct gaussian_prior){.mean = 0.3, .precision = p == 2 ? 3.0 : 0.0};
    }
    m->prior = has_prior ? s->prior : NULL;
    m->row_var = 0.002;
    for (size_t row = 0; row < ROWS; row++) {
        const size_t i = row / 3;
        m->weight[row] = 0.3 + rng_double(&rng);
        m->extra[row] = i == 4 ? 4.0 : 1.0;
        m->contrast[row] = i == 3;
        m->expected[row] = i == 5;
        m->photograph_var[row] = m->extra[row] * (2e-4 + 4e-4 * rng_double(&rng));
        for (size_t c = 0; c < LINEAR_COLOR_CAUSES; c++) {
            double *e = &m->color[row * LINEAR_COLOR_CAUSES + c];
            *e = c / 3 == row % 3 ? 0.006 * (rng_double(&rng) - 0.5) : 0.0;
            m->color_var[row] += *e * *e;
        }
        const double r = 0.05 * (1.0 + rng_double(&rng));
        for (int q = 0; q < 2; q++) {
            m->r[q][row] = r + 0.005 * (rng_double(&rng) - 0.5);
            m->r_var[q][row] = 1e-4 * (0.5 + rng_double(&rng));
        }
        for (size_t p = 0; p < PARAMS; p++) {
            const double j = rng_double(&rng) - 0.4;
            for (int q = 0; q < 2; q++) {
                m->j[q][row * PARAMS + p] = j + 0.03 * (rng_double(&rng) - 0.5);
                m->j_var[q][row * PARAMS + p] = 0.02 * rng_double(&rng);
            }
        }
    }
    m->pair[0] = (struct linear_pair){2, 1, 0.7};
    m->n_pair = 1;
}

static double noise_of(const struct linear_model *m, size_t row)
{
    return 0.25 * (m->r_var[0][row] + m->r_var[1][row]);
}

/* Correlation of the noise of tracing of two rows. */
static double shared(const struct linear_model *m, size_t row, size_t other)
{
    const size_t i = row / 3, j = other / 3;
    if (i == j) return 1.0;
    for (size_t k = 0; k < m->n_pair; k++)
        if ((m->pair[k].i == i && m->pair[k].j == j) || (m->pair[k].i == j && m->pair[k].j == i))
            return m->pair[k].correlation;
    return 0.0;
}

static double photograph_part(const struct linear_model *m, size_t row)
{
    return 0.5 * (m->photograph_var[row] - m->color_var[row]);
}

static double misfit_part(const struct linear_model *m, size_t row, const double misfit[2])
{
    if (m->expected[row] > 0.0) return misfit[0];
    return photograph_part(m, row) + misfit[m->contrast[row] > 0.0] * m->extra[row];
}

/* Covariance of the residuals of two rows. */
static double covariance_of(const struct linear_model *m, size_t row, size_t other, const double misfit[2])
{
    double v = shared(m, row, other) * sqrt(noise_of(m, row) * noise_of(m, other));
    if (misfit == NULL) return v; /* of tracing alone */
    if (row / 3 == other / 3) v += sqrt(photograph_part(m, row) * photograph_part(m, other));
    for (size_t c = 0; c < LINEAR_COLOR_CAUSES; c++)
        v += m->color[row * LINEAR_COLOR_CAUSES + c] * m->color[other * LINEAR_COLOR_CAUSES + c];
    return row == other ? v + misfit_part(m, row, misfit) : v;
}

/* Variance of the gradient by parameter p that the noise of the derivatives makes. */
static double derivative_part(const struct linear_model *m, size_t p)
{
    double sum = 0.0;
    for (size_t row = 0; row < ROWS; row++)
        for (size_t other = 0; other < ROWS; other++) {
            const double c = row == other ? 1.0 : row % 3 == other % 3 ? shared(m, row, other) : 0.0;
            const size_t a = row * PARAMS + p, b = other * PARAMS + p;
            double rr = 0.5 * (m->r[0][row] * m->r[1][other] + m->r[1][row] * m->r[0][other]);
            if (row == other) rr = fmax(0.0, rr);
            rr += 4.0 * c * sqrt(noise_of(m, row) * noise_of(m, other));
            sum += m->weight[row] * m->weight[other] * c * rr * 0.25 *
                   sqrt((m->j_var[0][a] + m->j_var[1][a]) * (m->j_var[0][b] + m->j_var[1][b]));
        }
    return sum;
}

static double range_sd(const struct coordinate *k) { return (k->upper - k->lower) / sqrt(12.0); }

/* J' V J + D and the mirrored J'J of the free parameters, in units of the ranges. misfit NULL: V of tracing alone. */
static void matrices(const struct setting *s, const double misfit[2], double *h, double *b)
{
    const struct linear_model *m = &s->m;
    for (size_t p = 0; p < FREE; p++)
        for (size_t q = 0; q < FREE; q++) {
            const double scale = range_sd(&s->k[moving[p]]) * range_sd(&s->k[moving[q]]);
            double hh = 0.0, bb = p == q ? derivative_part(m, moving[p]) : 0.0;
            for (size_t row = 0; row < ROWS; row++) {
                const double *ja = m->j[0] + row * PARAMS, *jb = m->j[1] + row * PARAMS;
                hh += 0.5 * m->weight[row] * (ja[moving[p]] * jb[moving[q]] + jb[moving[p]] * ja[moving[q]]);
                for (size_t o = 0; o < ROWS; o++) {
                    const double *oa = m->j[0] + o * PARAMS, *ob = m->j[1] + o * PARAMS;
                    bb += 0.5 * m->weight[row] * m->weight[o] * covariance_of(m, row, o, misfit) *
                          (ja[moving[p]] * ob[moving[q]] + jb[moving[p]] * oa[moving[q]]);
                }
            }
            h[p * FREE + q] = scale * hh;
            b[p * FREE + q] = scale * bb;
        }
}

static double precision_of(const struct setting *s, size_t p)
{
    return s->m.prior == NULL ? 0.0 : s->m.prior[p].precision * range_sd(&s->k[p]) * range_sd(&s->k[p]);
}

static void expected_covariance(const struct setting *s, const double misfit[2], double *cov)
{
    double h[FREE * FREE], b[FREE * FREE], inverse[FREE * FREE], half[FREE * FREE], s2 = 0.0;
    matrices(s, misfit, h, b);
    for (size_t row = 0; row < ROWS; row++)
        s2 += s->m.weight[row] / ROWS *
              (misfit_part(&s->m, row, misfit) + photograph_part(&s->m, row) + noise_of(&s->m, row));
    for (size_t p = 0; p < FREE; p++) {
        h[p * FREE + p] += s2 * (1.0 + precision_of(s, moving[p]));
        b[p * FREE + p] += s2 * s2 * (1.0 + precision_of(s, moving[p]));
    }
    assert_true(small_invert(h, FREE, inverse));
    small_multiply(inverse, b, FREE, half);
    small_multiply(half, inverse, FREE, cov);
    for (size_t p = 0; p < FREE; p++)
        for (size_t q = 0; q < FREE; q++) cov[p * FREE + q] *= range_sd(&s->k[moving[p]]) * range_sd(&s->k[moving[q]]);
}

static void assert_near(double got, double want, const char *what)
{
    if (!(fabs(got - want) <= 1e-9 * fabs(want) + 1e-15)) fail_msg("%s: %.12g, not %.12g", what, got, want);
}

static void check_parameter(const struct setting *s, const struct uncertainty *u, const double *cov, size_t i)
{
    const size_t p = moving[i];
    const double sd = sqrt(cov[i * FREE + i]), slope = coordinate_slope(&s->k[p], info[p].start);
    const double uniform = (info[p].upper - info[p].lower) / sqrt(12.0);
    double most = uniform;
    if (s->m.prior != NULL && s->m.prior[p].precision > 0.0) most = slope / sqrt(s->m.prior[p].precision);
    assert_near(u->se_param[p], fmin(slope * sd, fmin(uniform, most)), "error of a parameter");
    for (size_t k = 0; k < FREE; k++) {
        const double r = cov[i * FREE + k] / sqrt(cov[i * FREE + i] * cov[k * FREE + k]);
        assert_near(u->cov[p * PARAMS + moving[k]], cov[i * FREE + k], "covariance");
        assert_near(u->correlation[p * PARAMS + moving[k]], r, "correlation");
    }
    assert_int_equal(u->determined[p], uncertainty_determined(&s->k[p], sd, u->se_param[p]));
    assert_false(u->at_bound[p]);
}

static void test_against_the_formulas(void **state)
{
    (void)state;
    for (uint64_t seed = 1; seed <= 8; seed++) {
        struct setting s = {0};
        struct uncertainty u;
        double cov[FREE * FREE], misfit[2], h[FREE * FREE], b[FREE * FREE], inverse[FREE * FREE], trace = 0.0;
        make(&s, seed, seed % 2 == 0);
        linear_model_misfits(&s.m, FREE, misfit);
        assert_true(misfit[0] > 0.0 && misfit[1] > 0.0 && misfit[0] != misfit[1]);
        uncertainty_compute(&s.m, s.k, fixed, &u);
        expected_covariance(&s, misfit, cov);
        for (size_t i = 0; i < FREE; i++) check_parameter(&s, &u, cov, i);
        assert_true(u.se_param[FIXED] == 0.0 && u.determined[FIXED] && !u.at_bound[FIXED]);
        for (size_t q = 0; q < PARAMS; q++) {
            assert_true(u.cov[FIXED * PARAMS + q] == 0.0 && u.cov[q * PARAMS + FIXED] == 0.0);
            assert_true(u.correlation[FIXED * PARAMS + q] == (q == FIXED ? 1.0 : 0.0));
        }
        assert_true(u.n_param == PARAMS && u.misfit_var == misfit[0]);
        matrices(&s, NULL, h, b);
        for (size_t p = 0; p < FREE; p++) h[p * FREE + p] += s.m.row_var * (1.0 + precision_of(&s, moving[p]));
        assert_true(small_invert(h, FREE, inverse));
        for (size_t p = 0; p < FREE; p++)
            for (size_t q = 0; q < FREE; q++) trace += inverse[p * FREE + q] * b[q * FREE + p];
        assert_near(uncertainty_noise_decrease(&s.m, s.k, fixed), trace, "decrease");
        linear_model_release(&s.m);
    }
}

/* Where the replicas of the derivatives differ more than they agree, a quarter of the information is believed. */
static void test_least_information(void **state)
{
    (void)state;
    struct setting s = {0};
    struct uncertainty u;
    static const bool others_fixed[PARAMS] = {true, true, false, true};
    static const double agreement[] = {1.0, 0.3, 0.1, 0.0};
    make(&s, 3, false);
    for (size_t i = 0; i < sizeof agreement / sizeof *agreement; i++) {
        double mean = 0.0, noise = 0.0, misfit[2], s2 = 0.0, b = 0.0;
        for (size_t row = 0; row < ROWS; row++) {
            for (int q = 0; q < 2; q++) {
                s.m.j[q][row * PARAMS + 2] = agreement[i] + (q == 0 ? 1.0 : -1.0) * (1.0 - agreement[i]);
                s.m.j_var[q][row * PARAMS + 2] = 0.0;
            }
            mean += s.m.weight[row] * agreement[i] * agreement[i];
            noise += s.m.weight[row] * (1.0 - agreement[i]) * (1.0 - agreement[i]);
        }
        linear_model_misfits(&s.m, 1, misfit);
        for (size_t row = 0; row < ROWS; row++) {
            s2 += s.m.weight[row] / ROWS *
                  (misfit_part(&s.m, row, misfit) + photograph_part(&s.m, row) + noise_of(&s.m, row));
            for (size_t o = 0; o < ROWS; o++)
                b += s.m.weight[row] * s.m.weight[o] * covariance_of(&s.m, row, o, misfit) *
                     s.m.j[0][row * PARAMS + 2] * s.m.j[1][o * PARAMS + 2];
        }
        const double scale2 = range_sd(&s.k[2]) * range_sd(&s.k[2]), whole = mean * scale2 + s2;
        const double h = fmax(whole - noise * scale2, 0.25 * whole);
        uncertainty_compute(&s.m, s.k, others_fixed, &u);
        assert_near(u.cov[2 * PARAMS + 2], (fmax(b, 0.0) * scale2 + s2 * s2) / (h * h) * scale2, "variance");
    }
    linear_model_release(&s.m);
}

/* Mean variances are those of the means alone, of rows with a weight, without extra weights. */
static void test_mean_variances(void **state)
{
    (void)state;
    struct setting s = {0};
    struct uncertainty u;
    double noise = 0.0, photograph = 0.0;
    make(&s, 5, false);
    for (size_t row = 0; row < 3; row++) s.m.extra[row] = 0.0;
    for (size_t row = 3; row < ROWS; row++) {
        if (row / 3 == 3 || row / 3 == 5) continue;
        noise += noise_of(&s.m, row) / s.m.extra[row] / 9.0;
        photograph += s.m.photograph_var[row] / s.m.extra[row] / 9.0;
    }
    uncertainty_compute(&s.m, s.k, fixed, &u);
    assert_near(u.noise_var, noise, "noise");
    assert_near(u.photograph_var, photograph, "photographs");
    linear_model_release(&s.m);
}

/* What counts as determined, and as being at a bound, at the edges of both. */
static void test_edges(void **state)
{
    (void)state;
    struct setting s = {0};
    struct uncertainty u;
    make(&s, 7, false);
    const struct coordinate *line = &s.k[2], *log_k = &s.k[3];
    const double half_sd = 0.5 * 5.0 / sqrt(12.0);
    assert_true(uncertainty_determined(line, 0.99 * half_sd, 0.99 * half_sd));
    assert_false(uncertainty_determined(line, 1.01 * half_sd, 0.99 * half_sd));
    assert_false(uncertainty_determined(line, 0.99 * half_sd, 1.01 * half_sd));
    const double log_sd = 0.5 * (log(50.0) - log(1.0)) / sqrt(12.0);
    assert_true(log_sd < 0.69 && uncertainty_determined(log_k, 0.99 * log_sd, 1.0));
    assert_false(uncertainty_determined(log_k, 1.01 * log_sd, 1.0));
    struct coordinate decades = *log_k;
    decades.upper = decades.lower + log(1e6);
    decades.param_upper = 1e6;
    assert_true(uncertainty_determined(&decades, 0.68, 1.0) && !uncertainty_determined(&decades, 0.70, 1.0));
    static const struct {
        size_t p;
        double param;
        bool at_bound;
    } check[] = {{2, -2.0 + 0.0049, true}, {2, -2.0 + 0.0051, false}, {2, 3.0 - 0.0049, true}, {2, 3.0 - 0.0051, false},
                 {3, 1.0038, true},        {3, 1.0041, false},        {3, 49.81, true},        {3, 49.79, false}};
    for (size_t i = 0; i < sizeof check / sizeof *check; i++) {
        const double before = s.m.x_ref[check[i].p];
        s.m.x_ref[check[i].p] = coordinate_from_param(&s.k[check[i].p], check[i].param);
        uncertainty_compute(&s.m, s.k, fixed, &u);
        if (u.at_bound[check[i].p] != check[i].at_bound) fail_msg("%g at a bound", check[i].param);
        /* a parameter at a bound is not counted among those that explain the rows */
        double misfit[2];
        linear_model_misfits(&s.m, FREE - check[i].at_bound, misfit);
        assert_true(u.misfit_var == misfit[0]);
        s.m.x_ref[check[i].p] = before;
    }
    linear_model_release(&s.m);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_against_the_formulas),
        cmocka_unit_test(test_least_information),
        cmocka_unit_test(test_mean_variances),
        cmocka_unit_test(test_edges),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
