/* Phase functions, every one in the registry: f integrates to the albedo in each channel, samples follow their density,
 * scores against central differences, nothing is NaN along the fiber; extinction of the microflakes against a double
 * integral.
 */
#include "base/angle.h"
#include "renderer/scattering/phase_model.h"
#include "tests/support/model/fiber_angles.h"
#include "tests/support/model/model_stream.h"
#include "tests/support/statistics_test.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static struct phase_state *prepare(const struct phase_model *m, const double *param)
{
    struct phase_state *s = NULL;
    struct error err = {0};
    if (m->prepare(param, &s, &err) != STATUS_OK) fail_msg("%s", err.text);
    return s;
}

static void random_direction(struct rng *r, float w[3])
{
    direction(asin(2 * rng_double(r) - 1), 2 * M_PI * rng_double(r), w);
}

/* Point k of the parameter ranges: the lower bounds, the upper bounds, the start, then random points. Widths lie
 * above the share `from` of their range. */
static void box_point(const struct phase_model *m, unsigned k, double from, struct rng *r, double *param)
{
    for (size_t p = 0; p < m->n_param; p++) {
        const struct param_info *i = &m->param[p];
        double t = k == 0 ? 0 : k == 1 ? 1 : rng_double(r);
        if (i->channel < 0) t = from + (1 - from) * t;
        param[p] = k == 2 ? i->start : i->lower + t * (i->upper - i->lower);
    }
}

enum { N_THETA = 48, N_PHI = 48, SUB = 24, N_SAMPLE = 100000 };

static size_t cell_of(const float w[3])
{
    double theta = atan2((double)w[0], hypot((double)w[1], (double)w[2])), phi = atan2((double)w[2], (double)w[1]);
    size_t i = (size_t)fmin(N_THETA - 1, (theta / M_PI + 0.5) * N_THETA),
           j = (size_t)fmin(N_PHI - 1, (phi / (2 * M_PI) + 0.5) * N_PHI);
    return i * N_PHI + j;
}

/* Integrals over the sphere of f and of the density, cell by cell for the latter. */
static void integrate(const struct phase_model *m, const struct phase_state *s, const float wo[3], const float *weight,
                      double f_sum[3], double *cell)
{
    double h_theta = M_PI / (N_THETA * SUB), h_phi = 2 * M_PI / (N_PHI * SUB);
    memset(cell, 0, N_THETA * N_PHI * sizeof *cell);
    for (int c = 0; c < 3; c++) f_sum[c] = 0;
    for (size_t i = 0; i < N_THETA * SUB; i++) {
        double theta = -M_PI_2 + ((double)i + 0.5) * h_theta, area = cos(theta) * h_theta * h_phi;
        for (size_t j = 0; j < N_PHI * SUB; j++) {
            float wi[3], f[3];
            direction(theta, -M_PI + ((double)j + 0.5) * h_phi, wi);
            cell[i / SUB * N_PHI + j / SUB] += (double)m->eval_pdf(s, wi, wo, weight, f, NULL) * area;
            for (int c = 0; c < 3; c++) f_sum[c] += (double)f[c] * area;
        }
    }
}

static void check_integrals(const struct phase_model *m, const double *param, const float wo[3], const float *weight,
                            struct rng *r, double least_p)
{
    static double cell[N_THETA * N_PHI], count[N_THETA * N_PHI];
    struct phase_state *s = prepare(m, param);
    double f_sum[3], total = 0, n_degree;
    integrate(m, s, wo, weight, f_sum, cell);
    for (size_t c = 0; c < 3; c++) {
        double alpha = param[(size_t)scattering_param_index(
                                 &(struct scattering_model){.n_param = m->n_param, .param = m->param}, "alpha.r") +
                             c];
        if (fabs(f_sum[c] / alpha - 1) > 3e-3)
            fail_msg("%s, channel %zu, wo %g %g %g: f integrates to %.5f albedos", m->id, c, (double)wo[0],
                     (double)wo[1], (double)wo[2], f_sum[c] / alpha);
    }
    for (size_t i = 0; i < N_THETA * N_PHI; i++) total += cell[i];
    if (fabs(total - 1) > 5e-3)
        fail_msg("%s, wo %g %g %g: density integrates to %.5f", m->id, (double)wo[0], (double)wo[1], (double)wo[2],
                 total);
    for (size_t i = 0; i < N_THETA * N_PHI; i++) cell[i] *= N_SAMPLE / total;
    memset(count, 0, sizeof count);
    for (int i = 0; i < N_SAMPLE; i++) {
        float u[3] = {rng_float(r), rng_float(r), rng_float(r)}, wi[3];
        m->sample(s, wo, weight, u, wi);
        count[cell_of(wi)]++;
    }
    m->release(s);
    double x = chi_square_statistic(count, cell, N_THETA * N_PHI, &n_degree), p = chi_square_tail(x, n_degree);
    if (p < least_p)
        fail_msg("%s, wo %g %g %g: chi-square %.1f at %.0f degrees of freedom", m->id, (double)wo[0], (double)wo[1],
                 (double)wo[2], x, n_degree);
}

static void integrals_and_samples(void **state)
{
    (void)state;
    static const double angle_deg[][2] = {{0.3, 90}, {-25, 200}, {50, 10}, {75, -60}, {-88, 33}};
    enum { N_ANGLE = sizeof angle_deg / sizeof angle_deg[0], N_SET = 3 };
    static const float channel_weight[3] = {1, 0.1f, 0};
    size_t n_model = 0;
    while (phase_registry()[n_model] != NULL) n_model++;
    for (size_t k = 0; k < n_model; k++) {
        struct rng r;
        model_stream_start(&r, 31, phase_registry()[k]->id);
        for (unsigned set = 0; set < N_SET; set++)
            for (int a = 0; a < N_ANGLE; a++) {
                float wo[3];
                double param[SCATTERING_MAX_PARAM];
                box_point(phase_registry()[k], 1 + set, 0.08, &r, param); /* widths that the grid resolves */
                direction(angle_deg[a][0] * RAD_PER_DEG, angle_deg[a][1] * RAD_PER_DEG, wo);
                check_integrals(phase_registry()[k], param, wo, a % 2 ? channel_weight : NULL, &r,
                                0.01 / (double)(n_model * N_SET * N_ANGLE));
            }
    }
}

/* ln f and ln s by each parameter: three-point differences, one-sided where a bound is near. */
static void check_scores(const struct phase_model *m, const double *param, struct rng *r)
{
    enum { N = 24 };
    float wi[N][3], wo[N][3], score[N][3 * SCATTERING_MAX_PARAM], f[4][N][3];
    double sigma[4][N], d_sigma[N];
    struct phase_state *s = prepare(m, param);
    for (int i = 0; i < N; i++) {
        float u[3] = {rng_float(r), rng_float(r), rng_float(r)};
        random_direction(r, wo[i]);
        m->sample(s, wo[i], NULL, u, wi[i]);
        m->eval_pdf(s, wi[i], wo[i], NULL, f[3][i], score[i]);
        float d;
        sigma[3][i] = (double)phase_extinction_at(m->extinction(s), hypotf(wo[i][1], wo[i][2]), &d);
        d_sigma[i] = (double)d;
    }
    int i_extinction = m->extinction(s)->i_param;
    m->release(s);
    for (size_t p = 0; p < m->n_param; p++) {
        const struct param_info *info = &m->param[p];
        double room = info->channel >= 0 ? fmin(param[p], fmax(1 - param[p], 1e-3)) : param[p];
        double h = 5e-3 * fmin(room, 0.2), weight[3] = {-0.5, 0, 0.5};
        double shift = param[p] - h < info->lower ? 1 : param[p] + h > info->upper ? -1 : 0;
        const double one_sided[2][3] = {{-1.5, 2, -0.5}, {0.5, -2, 1.5}};
        if (shift != 0) memcpy(weight, one_sided[shift > 0 ? 0 : 1], sizeof weight);
        for (int j = 0; j < 3; j++) {
            double moved[SCATTERING_MAX_PARAM];
            memcpy(moved, param, m->n_param * sizeof *param);
            moved[p] += (j - 1 + shift) * h;
            s = prepare(m, moved);
            for (int i = 0; i < N; i++) {
                float unused;
                m->eval_pdf(s, wi[i], wo[i], NULL, f[j][i], NULL);
                sigma[j][i] = (double)phase_extinction_at(m->extinction(s), hypotf(wo[i][1], wo[i][2]), &unused);
            }
            m->release(s);
        }
        for (int i = 0; i < N; i++) {
            double fd_sigma = 0, want = (int)p == i_extinction ? d_sigma[i] : 0;
            for (int j = 0; j < 3; j++) fd_sigma += weight[j] * sigma[j][i] / h;
            if (!(fabs(fd_sigma - want) <= 1e-6 / h * sigma[3][i] + 3e-3 * fabs(want)))
                fail_msg("%s, extinction by %s: %g, difference %g", m->id, info->name, want, fd_sigma);
            for (int c = 0; c < 3; c++) {
                double fd = 0, got = (double)score[i][(size_t)c * m->n_param + p];
                if (f[3][i][c] < 1e-25f) continue; /* no weight at all */
                for (int j = 0; j < 3; j++) fd += weight[j] * log((double)f[j][i][c]) / h;
                if (!(fabs(fd - got) <= 1.5e-6 / h + 2e-3 * fabs(got)))
                    fail_msg("%s, %s, channel %d: score %g, difference %g", m->id, info->name, c, got, fd);
            }
        }
    }
}

static void scores_against_differences(void **state)
{
    (void)state;
    for (size_t k = 0; phase_registry()[k] != NULL; k++) {
        struct rng r;
        model_stream_start(&r, 32, phase_registry()[k]->id);
        for (unsigned b = 0; b < 8; b++) {
            double param[SCATTERING_MAX_PARAM];
            box_point(phase_registry()[k], b, 0, &r, param);
            check_scores(phase_registry()[k], param, &r);
        }
    }
}

static void check_finite(const struct phase_model *m, const struct phase_state *s, const float wo[3], const float wi[3])
{
    float f[3], score[3 * SCATTERING_MAX_PARAM], pdf = m->eval_pdf(s, wi, wo, NULL, f, score);
    assert_true(isfinite(pdf) && pdf >= 0);
    for (int c = 0; c < 3; c++) assert_true(isfinite(f[c]) && f[c] >= 0);
    for (size_t p = 0; p < 3 * m->n_param; p++) assert_true(isfinite(score[p]));
}

static void nothing_is_nan(void **state)
{
    (void)state;
    static const float special[][3] = {{1, 0, 0},           {-1, 0, 0},
                                       {1, 1e-7f, 0},       {-1, 0, 1e-7f},
                                       {1, 1e-20f, 1e-20f}, {0.9999999f, 3e-4f, 0},
                                       {0, 1, 0},           {0, 0, -1},
                                       {0, -1, 0},          {0, 0.70710678f, 0.70710678f}};
    enum { N_SPECIAL = sizeof special / sizeof special[0] };
    const float corner[3] = {0, 0.5f, 0.99999994f};
    for (size_t k = 0; phase_registry()[k] != NULL; k++) {
        const struct phase_model *m = phase_registry()[k];
        struct rng r;
        model_stream_start(&r, 33, m->id);
        for (unsigned b = 0; b < 5; b++) {
            double param[SCATTERING_MAX_PARAM];
            box_point(m, b, 0, &r, param);
            struct phase_state *s = prepare(m, param);
            for (size_t i = 0; i < N_SPECIAL; i++) {
                for (size_t j = 0; j < N_SPECIAL; j++) check_finite(m, s, special[i], special[j]);
                for (int u = 0; u < 27; u++) {
                    float uu[3] = {corner[u % 3], corner[u / 3 % 3], corner[u / 9]}, wi[3], f[3];
                    m->sample(s, special[i], NULL, uu, wi);
                    assert_true(fabsf(wi[0] * wi[0] + wi[1] * wi[1] + wi[2] * wi[2] - 1) < 1e-5f);
                    /* a sample that is rounded to the fiber's axis has no azimuth and may have no density: the tracer
                     * ends the path there */
                    bool on_axis = wi[1] == 0 && wi[2] == 0;
                    float pdf = m->eval_pdf(s, wi, special[i], NULL, f, NULL);
                    assert_true(on_axis ? pdf >= 0 : pdf > 0);
                    check_finite(m, s, special[i], wi);
                }
            }
            m->release(s);
        }
    }
}

static void registry_is_sound(void **state)
{
    (void)state;
    assert_null(phase_find("no_such_model.v1"));
    for (size_t k = 0; phase_registry()[k] != NULL; k++) {
        const struct phase_model *m = phase_registry()[k];
        assert_ptr_equal(phase_find(m->id), m);
        assert_true(m->n_param <= PHASE_MAX_PARAM);
        for (size_t p = 0; p < m->n_param; p++) {
            double param[SCATTERING_MAX_PARAM];
            const double bad[3] = {NAN, m->param[p].upper * 1.01, m->param[p].lower * 0.99};
            for (int b = 0; b < 3; b++) {
                struct phase_state *s = NULL;
                struct error err = {0};
                for (size_t o = 0; o < m->n_param; o++) param[o] = m->param[o].start;
                param[p] = bad[b];
                assert_int_equal(m->prepare(param, &s, &err), STATUS_INVALID);
                assert_string_equal(err.field, m->param[p].name);
            }
        }
    }
}

/* s(w) against a direct integral of |w . m| D(m) dm, and the integral of D, which is 1. */
static void microflake_extinction(void **state)
{
    (void)state;
    const struct phase_model *m = phase_find("microflake.v1");
    const double gamma[3] = {0.02, 0.3, 1.5};
    for (int g = 0; g < 3; g++) {
        double param[4] = {0.5, 0.5, 0.5, gamma[g]}, norm = 0;
        struct phase_state *s = prepare(m, param);
        for (double sine = 0; sine <= 1; sine += 0.125) {
            enum { N_T = 4000, N_AZIMUTH = 720 };
            double sum = 0, cosine = sqrt(1 - sine * sine);
            norm = 0;
            for (int i = 0; i < N_T; i++) {
                double t = 2 * (i + 0.5) / N_T - 1, b = sqrt(1 - t * t), inner = 0;
                double d = exp(-t * t / (2 * gamma[g] * gamma[g]));
                norm += d * 2 * M_PI * 2 / N_T;
                if (d < 1e-14) continue;
                for (int j = 0; j < N_AZIMUTH; j++)
                    inner += fabs(t * cosine + b * sine * cos(2 * M_PI * (j + 0.5) / N_AZIMUTH));
                sum += d * inner * 2 * M_PI / N_AZIMUTH * 2 / N_T;
            }
            float unused, got = phase_extinction_at(m->extinction(s), (float)sine, &unused);
            if (fabs((double)got * norm / sum - 1) > 2e-3)
                fail_msg("gamma %g, sine %g: %g, integral %g", gamma[g], sine, (double)got, sum / norm);
        }
        m->release(s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(registry_is_sound),          cmocka_unit_test(microflake_extinction),
        cmocka_unit_test(scores_against_differences), cmocka_unit_test(nothing_is_nan),
        cmocka_unit_test(integrals_and_samples),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
