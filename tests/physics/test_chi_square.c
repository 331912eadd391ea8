/* Sampling of every scattering model: the density integrates to 1 and samples follow it. */
#include "base/angle.h"
#include "base/rng.h"
#include "renderer/scattering/scattering.h"
#include "tests/support/agreement.h"
#include "tests/support/model/model_stream.h"
#include "tests/support/statistics_test.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { N_THETA = 48, N_PHI = 48, N_NODE = 3, MOST_SUB = 16, N_SAMPLE = 200000 };

static size_t cell_of(const float w[3])
{
    double theta = atan2((double)w[0], hypot((double)w[1], (double)w[2])), phi = atan2((double)w[2], (double)w[1]);
    size_t i = (size_t)fmin(N_THETA - 1, (theta / M_PI + 0.5) * N_THETA),
           j = (size_t)fmin(N_PHI - 1, (phi / (2 * M_PI) + 0.5) * N_PHI);
    return i * N_PHI + j;
}

/* A density of one outgoing direction. */
struct density {
    const struct scattering_model *m;
    const struct scattering_state *s;
    const float *wo, *weight;
};

/* Integrates the density over a cell by Gauss's rule with 3 x 3 nodes in each of sub x sub parts of it. */
static double cell_integral(const struct density *d, size_t i_theta, size_t i_phi, size_t sub)
{
    static const double node[N_NODE] = {0.5 - 0.5 * 0.7745966692414834, 0.5, 0.5 + 0.5 * 0.7745966692414834},
                        node_weight[N_NODE] = {5 / 18.0, 8 / 18.0, 5 / 18.0};
    double sum = 0, h_theta = M_PI / (double)(N_THETA * sub), h_phi = 2 * M_PI / (double)(N_PHI * sub);
    for (size_t i = 0; i < N_NODE * sub; i++) {
        double theta = -M_PI_2 + ((double)(i_theta * sub + i / N_NODE) + node[i % N_NODE]) * h_theta;
        for (size_t j = 0; j < N_NODE * sub; j++) {
            double phi = -M_PI + ((double)(i_phi * sub + j / N_NODE) + node[j % N_NODE]) * h_phi;
            float wi[3] = {(float)sin(theta), (float)(cos(theta) * cos(phi)), (float)(cos(theta) * sin(phi))};
            sum += (double)d->m->pdf(d->s, wi, d->wo, d->weight) * cos(theta) * h_theta * h_phi *
                   node_weight[i % N_NODE] * node_weight[j % N_NODE];
        }
    }
    return sum;
}

/* Counts that are expected in each cell. Parts are halved until that changes a count by less than a fiftieth of its
 * standard deviation, or of 1, and so chi-square of all cells by far less than its own. Returns the sum of the
 * integrals. */
static double expected_counts(const struct density *d, double *expected)
{
    double total = 0;
    for (size_t i = 0; i < N_THETA; i++)
        for (size_t j = 0; j < N_PHI; j++) {
            double n = N_SAMPLE * cell_integral(d, i, j, 1), before = INFINITY;
            for (size_t sub = 2; sub <= MOST_SUB && fabs(n - before) > 0.02 * sqrt(fmax(n, 1)); sub *= 2) {
                before = n;
                n = N_SAMPLE * cell_integral(d, i, j, sub);
            }
            expected[i * N_PHI + j] = n;
            total += n / N_SAMPLE;
        }
    return total;
}

static void check_counts(const struct scattering_model *m, const float wo[3], const char *of, const double *count,
                         const double *expected, size_t n, double least_p)
{
    double n_degree, x = chi_square_statistic(count, expected, n, &n_degree), p = chi_square_tail(x, n_degree);
    if (p < least_p)
        fail_msg("%s: chi-square of %s %.1f at %.0f degrees of freedom (p = %.2g) for wo = %g %g %g", m->id, of, x,
                 n_degree, p, (double)wo[0], (double)wo[1], (double)wo[2]);
}

static void check(const struct scattering_model *m, const struct scattering_state *s, const float wo[3],
                  const float *weight, struct rng *r, double least_p)
{
    static double expected[N_THETA * N_PHI], count[N_THETA * N_PHI];
    double total = expected_counts(&(struct density){m, s, wo, weight}, expected), row_count[N_THETA] = {0},
           row_expected[N_THETA] = {0};
    if (fabs(total - 1) > 2e-3)
        fail_msg("%s: density integrates to %.6f for wo = %g %g %g", m->id, total, (double)wo[0], (double)wo[1],
                 (double)wo[2]);
    for (size_t i = 0; i < N_THETA * N_PHI; i++) expected[i] /= total; /* removes the error of the quadrature */
    memset(count, 0, sizeof count);
    for (int i = 0; i < N_SAMPLE; i++) {
        float u[3] = {rng_float(r), rng_float(r), rng_float(r)}, wi[3];
        m->sample(s, wo, weight, u, wi);
        count[cell_of(wi)]++;
    }
    check_counts(m, wo, "cells", count, expected, N_THETA * N_PHI, least_p);
    /* Rows of cells, in which a share of a lobe that is 2 % off is not lost in the noise of all cells. */
    for (size_t i = 0; i < N_THETA * N_PHI; i++) {
        row_count[i / N_PHI] += count[i];
        row_expected[i / N_PHI] += expected[i];
    }
    check_counts(m, wo, "rows", row_count, row_expected, N_THETA, least_p);
}

/* Start; everything largest; narrow lobes; shares least. */
static void set_parameters(const struct scattering_model *m, int set, double *param)
{
    for (size_t p = 0; p < m->n_param; p++) {
        const struct param_info *i = &m->param[p];
        bool angle = i->channel < 0, share = angle && i->unit != PARAM_UNIT_DEG;
        param[p] = set == 0   ? i->start
                   : set == 1 ? i->upper
                   : set == 3 ? (share ? i->lower : i->start)
                   : angle    ? i->lower + 0.1 * (i->upper - i->lower)
                              : 0.2 + 0.3 * (i->channel % 2);
    }
}

static void samples_follow_the_density(void **state)
{
    (void)state;
    static const double angle_deg[][2] = {{0, 90}, {-25, 200}, {50, 10}, {75, -60}, {-88, 33}, {90, 0}};
    enum { N_ANGLE = sizeof angle_deg / sizeof angle_deg[0], N_SET = 4 };
    static const float coloured[2][3] = {{1, 0.1f, 0},
                                         {0, 0.3f, 20}}; /* the weights of the channels change the choice of lobes */
    const float *const weight[3] = {NULL, coloured[0], coloured[1]};
    size_t n_model = 0;
    while (scattering_registry()[n_model] != NULL) n_model++;
    /* By day every other direction of a set of parameters, the next set having the others. */
    const int step = is_long_variant() ? 1 : 2;
    double least_p =
        0.005 * step / (double)(n_model * N_ANGLE * N_SET); /* 1 % for the whole family of cells and rows */
    for (size_t k = 0; k < n_model; k++) {
        const struct scattering_model *m = scattering_registry()[k];
        struct rng r;
        model_stream_start(&r, 11, m->id);
        for (int set = 0; set < N_SET; set++) {
            double param[SCATTERING_MAX_PARAM];
            struct scattering_state *s = NULL;
            struct error err = {0};
            set_parameters(m, set, param);
            if (m->prepare(param, &s, &err) != STATUS_OK) fail_msg("%s", err.text);
            for (int a = set % step; a < N_ANGLE; a += step) {
                double theta = angle_deg[a][0] * RAD_PER_DEG, phi = angle_deg[a][1] * RAD_PER_DEG;
                float wo[3] = {(float)sin(theta), (float)(cos(theta) * cos(phi)), (float)(cos(theta) * sin(phi))};
                check(m, s, wo, weight[(set + a) % 3], &r, least_p);
            }
            m->release(s);
        }
    }
}

/* The grid above is too coarse for the narrowest lobes. This test uses one-dimensional histograms of the angles. */
static void narrowest_lobes(void **state)
{
    (void)state;
    const struct scattering_model *m = scattering_find("two_lobe.v1");
    double param[9] = {0.5, 0.5, 0.5, 0.5, 0.5, 0.5, m->param[6].lower, m->param[7].lower, m->param[8].lower};
    struct scattering_state *s = NULL;
    struct rng r;
    assert_int_equal(m->prepare(param, &s, NULL), STATUS_OK);
    rng_start(&r, &(struct rng_key){12, 0, 0, 0}, 0, 0);
    enum { N = 60, DRAWS = 400000 };
    double count[N] = {0}, expected[N], n_degree, sd = param[8], n_tt = 0;
    const float wo[3] = {0, -1, 0};
    for (int i = 0; i < DRAWS;
         i++) { /* azimuth of the TT lobe: the half behind the fiber and |th| beyond the R lobe's reach */
        float u[3] = {0.999f, rng_float(&r), rng_float(&r)}, wi[3];
        m->sample(s, wo, NULL, u, wi);
        double phi = atan2((double)wi[2], (double)wi[1]);
        int cell = (int)floor((phi / (5 * sd) + 1) * 0.5 * N);
        if (cell >= 0 && cell < N) count[cell]++;
        n_tt++;
    }
    double norm = 0;
    for (int i = 0; i < 20000; i++) norm += exp((cos((i + 0.5) * M_PI / 20000) - 1) / (sd * sd)) * 2 * M_PI / 20000;
    for (int i = 0; i < N; i++) {
        expected[i] = 0;
        for (int j = 0; j < 50; j++) {
            double phi = 5 * sd * (2 * (i + (j + 0.5) / 50) / N - 1);
            expected[i] += n_tt * exp((cos(phi) - 1) / (sd * sd)) / norm * 10 * sd / N / 50;
        }
    }
    double x = chi_square_statistic(count, expected, N, &n_degree);
    m->release(s);
    if (chi_square_tail(x, n_degree) < 1e-3) fail_msg("chi-square %.1f at %.0f", x, n_degree);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(samples_follow_the_density), cmocka_unit_test(narrowest_lobes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
