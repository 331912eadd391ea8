/* wave_silk.v2, wave_trilobal.v2, wave_cotton.v2: what the tables are made of against geometric optics of an elliptical
 * section, the tables and the light sent back against the solver, and the furnace from both sides.
 */
#include "base/angle.h"
#include "renderer/scattering/models/elliptical/ellipse_ray.h"
#include "renderer/scattering/models/wave/solver/wave_mean.h"
#include "renderer/scattering/models/wave/wave_table.h"
#include "renderer/scattering/scattering.h"
#include "tests/support/model/fiber_angles.h"
#include "tests/support/model/model_furnace.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { N_WAVE = 40 };
#define BLUR (10 * RAD_PER_DEG)

/* Fourier coefficients of N(ph), blurred: those of a density about straight on, which is half a turn from back. */
static void waves_of_density(const double *density, double wave[N_WAVE + 1])
{
    for (int k = 0; k <= N_WAVE; k++) {
        wave[k] = 0;
        for (int j = 0; j < WAVE_MEAN_N_ANGLE; j++)
            wave[k] += density[j] * cos(k * (2 * M_PI * j / WAVE_MEAN_N_ANGLE - M_PI)) * 2 * M_PI / WAVE_MEAN_N_ANGLE;
        wave[k] *= exp(-0.5 * pow(k * BLUR, 2));
    }
}

/* Root mean square over a turn of a function with these coefficients. */
static double size_of(const double wave[N_WAVE + 1])
{
    double sum = wave[0] * wave[0];
    for (int k = 1; k <= N_WAVE; k++) sum += 2 * wave[k] * wave[k];
    return sqrt(sum);
}

static double difference(const double a[N_WAVE + 1], const double b[N_WAVE + 1])
{
    double off[N_WAVE + 1];
    for (int k = 0; k <= N_WAVE; k++) off[k] = a[k] - b[k];
    return size_of(off);
}

/* Mean of a section of radius 1 of one size for light at an angle to its plane. */
static void solve_mean(const struct wave_outline *o, double x, double index, double clear, double theta_rad,
                       struct wave_mean *mean)
{
    const struct oblique_problem p = {o, x, index - I * log(clear) / (4 * x), theta_rad,
                                      wave_solver_nodes(o, x, index, 3.5)};
    struct error err = {0};
    double sum = 0;
    if (wave_mean_over_turns(&p, mean, &err) != STATUS_OK) fail_msg("%s", err.text);
    for (int j = 0; j < WAVE_MEAN_N_ANGLE; j++) sum += mean->density[j] * 2 * M_PI / WAVE_MEAN_N_ANGLE;
    assert_true(fabs(sum + mean->absorbed - 1) < 1e-9);
}

/* Its waves; returns the light that the fiber meets. */
static double solve_size(const struct wave_outline *o, double x, double index, double clear, double theta_rad,
                         double wave[N_WAVE + 1])
{
    struct wave_mean mean;
    solve_mean(o, x, index, clear, theta_rad, &mean);
    waves_of_density(mean.density, wave);
    return mean.met;
}

static void outline_of(const struct wave_section *section, struct wave_outline *o)
{
    section->outline(o);
    wave_outline_scale(o, 1 / sqrt(wave_outline_area(o) / M_PI));
}

/* ---- geometric optics ---- */

static void rays_of_ellipse(double index, double ratio, double clear, double wave[N_WAVE + 1])
{
    enum { N = 17711, STEP = 10946 };
    const struct ellipse e = ellipse_of(index, ratio);
    const struct ellipse_wall wall = ellipse_wall_at(&e, 1);
    double weights = 0;
    memset(wave, 0, (N_WAVE + 1) * sizeof *wave);
    for (long i = 0; i < N; i++) {
        const double x = M_PI * (((double)i + 0.5) / N - 0.5);
        const struct ellipse_entry entry = ellipse_enter(&e, M_PI * (double)(i * STEP % N) / N, x);
        struct ellipse_path path;
        ellipse_follow(&e, &wall, &entry, &path);
        const double weight = entry.half_width.v * cos(x);
        weights += weight;
        for (int p = 0; p < path.n; p++) {
            const double power = weight * path.share[p].v * pow(clear, 0.5 * path.length[p].v);
            wave[0] += power;
            for (int k = 1; k <= N_WAVE && p < ELLIPSE_N_MODE; k++) wave[k] += power * cos(k * path.azimuth[p].v);
        }
    }
    for (int k = 0; k <= N_WAVE; k++) wave[k] *= exp(-0.5 * pow(k * BLUR, 2)) / weights;
}

/* Waves go over to rays as they get short: what differs falls about as x^(-2/3), the law of the edges. */
static void waves_against_rays(void **unused)
{
    (void)unused;
    enum { N_SIZE = 3 };
    const double ratio = 1.5, index = 1.55, clear = 0.5;
    double rays[N_WAVE + 1], before = INFINITY, before_met = INFINITY;
    struct wave_outline o;
    wave_outline_ellipse(&o, sqrt(ratio), 1 / sqrt(ratio));
    rays_of_ellipse(index, ratio, clear, rays);
    for (double x = 10; x < 45; x *= 2) {
        double wave[N_WAVE + 1] = {0}, met = 0;
        for (int i = 0; i < N_SIZE; i++) { /* sizes over a tenth, so that interference averages out */
            double one[N_WAVE + 1];
            met += solve_size(&o, x * (1 + 0.1 * (i - 1) / N_SIZE), index, clear, 0, one) / N_SIZE - 1.0 / N_SIZE;
            for (int k = 0; k <= N_WAVE; k++) wave[k] += one[k] / N_SIZE;
        }
        const double off = difference(wave, rays) / size_of(rays);
        print_message("x = %g: N differs by %.4f, left %.4f of the light (rays %.4f), met beyond the width %.4f\n", x,
                      off, wave[0], rays[0], met);
        assert_true(off < before * pow(2, -0.5) && met < before_met * pow(2, -0.5));
        assert_true(off < pow(x, -2.0 / 3) && met < pow(x, -2.0 / 3));
        before = off;
        before_met = met;
    }
}

/* ---- tables ---- */

static void table_waves(const struct wave_table *t, int tilt, int channel, int i_clear, double wave[N_WAVE + 1])
{
    for (int k = 0; k <= N_WAVE; k++)
        wave[k] = (double)t->wave[tilt][channel][i_clear][k] / WAVE_TABLE_ONE * exp(-0.5 * pow(k * BLUR, 2));
}

/* Sizes of the green channel of silk against its table, by the scatter of the sizes; across the fiber and oblique. */
static void table_of_silk(void **unused)
{
    (void)unused;
    enum { N_SIZE = 3, CLEAR = 3 };
    static const int tilts[2] = {WAVE_TABLE_N_TILT - 1, WAVE_TABLE_N_TILT / 2};
    const struct wave_section *silk = &wave_sections[0];
    const double clear = pow(wave_table_root(CLEAR), 3);
    struct wave_outline o;
    assert_string_equal(silk->name, "silk");
    outline_of(silk, &o);
    for (int k = 0; k < 2; k++) {
        double one[N_SIZE][N_WAVE + 1], mean[N_WAVE + 1] = {0}, table[N_WAVE + 1], other[N_WAVE + 1], scatter = 0;
        for (int i = 0; i < N_SIZE; i++) { /* the mean square of the places is that of the table's distribution */
            const double x =
                2 * M_PI * silk->radius_m / wave_length_m[1] * exp((i - 1) * sqrt(1.5) * WAVE_TABLE_SPREAD);
            solve_size(&o, x, silk->index, clear, acos(wave_table_cosine(tilts[k])), one[i]);
            for (int j = 0; j <= N_WAVE; j++) mean[j] += one[i][j] / N_SIZE;
        }
        for (int i = 0; i < N_SIZE; i++) scatter += pow(difference(one[i], mean), 2) / (N_SIZE * (N_SIZE - 1.0));
        table_waves(&wave_silk_table, tilts[k], 1, CLEAR, table);
        const double off = difference(mean, table), size = size_of(table);
        print_message("silk, cos(theta) %.3f: %.4f from its table, standard error %.4f\n", wave_table_cosine(tilts[k]),
                      off / size, sqrt(scatter) / size);
        assert_true(off < 3 * sqrt(scatter));
        for (int i = 0; i < 3; i++) { /* the others, and other angles, are something else */
            const struct wave_table *t[3] = {&wave_trilobal_table, &wave_cotton_table, &wave_silk_table};
            table_waves(t[i], i < 2 ? tilts[k] : tilts[1 - k], 1, CLEAR, other);
            assert_true(difference(mean, other) > 3 * sqrt(scatter));
        }
    }
}

/* Weights of the values of C give the third power of the cube root exactly, and its slope; those of theta the third
 * power of the cosine, which is not beyond the least one. */
static void weights_between_values(void **unused)
{
    (void)unused;
    for (double root = wave_table_root(0); root <= 1; root += 0.03) {
        double weight[WAVE_TABLE_N_CLEAR], slope[WAVE_TABLE_N_CLEAR], sum[4] = {0};
        wave_table_weights(root, weight, slope);
        for (int i = 0; i < WAVE_TABLE_N_CLEAR; i++) {
            const double cube = pow(wave_table_root(i), 3);
            sum[0] += weight[i];
            sum[1] += slope[i];
            sum[2] += weight[i] * cube;
            sum[3] += slope[i] * cube;
        }
        assert_true(fabs(sum[0] - 1) < 1e-12 && fabs(sum[1]) < 1e-11);
        assert_true(fabs(sum[2] - pow(root, 3)) < 1e-12 && fabs(sum[3] - 3 * root * root) < 1e-11);
    }
    for (double cosine = 0; cosine <= 1; cosine += 0.03) {
        double weight[WAVE_TABLE_N_TILT], cube = 0;
        wave_table_tilt_weights(cosine, weight);
        for (int i = 0; i < WAVE_TABLE_N_TILT; i++) cube += weight[i] * pow(wave_table_cosine(i), 3);
        assert_true(fabs(cube - pow(fmax(cosine, WAVE_TABLE_LEAST_COSINE), 3)) < 1e-12);
    }
}

/* ---- models ---- */

/* All light leaves, from both sides, but for what C_T = 0.999 takes on ways of up to three diameters. */
static void lossless_from_both_sides(void **unused)
{
    (void)unused;
    static const char *const id[] = {"wave_silk.v2", "wave_trilobal.v2", "wave_cotton.v2"};
    static const double theta_deg[] = {0, -40, 75}, width[2][2] = {{4, 5}, {20, 25}};
    for (int m = 0; m < 3; m++)
        for (int w = 0; w < 2; w++) {
            const struct scattering_model *model = scattering_find(id[m]);
            const double param[5] = {0.999, 0.999, 0.999, width[w][0] * RAD_PER_DEG, width[w][1] * RAD_PER_DEG};
            const struct model_furnace furnace = {.n_theta = 720, .n_phi = 90};
            struct scattering_state *s = NULL;
            struct error err = {0};
            if (model->prepare(param, &s, &err) != STATUS_OK) fail_msg("%s", err.text);
            for (int t = 0; t < 3; t++)
                for (int side = 0; side < 2; side++) {
                    double sum[3];
                    model_furnace(model, s, &furnace, theta_deg[t] * RAD_PER_DEG, side == 0, sum);
                    for (int c = 0; c < 3; c++)
                        if (!(sum[c] > 0.996 && sum[c] < 1.001))
                            fail_msg("%s, %g degrees, side %d: %.5f", id[m], theta_deg[t], side, sum[c]);
                }
            model->release(s);
        }
}

/* Share of the light from theta that a model sends into the half in front of the fiber. */
static double model_back(const struct scattering_model *m, const struct scattering_state *s, double theta_rad)
{
    enum { N_THETA = 720, N_PHI = 180 };
    double sum = 0, back = 0;
    float wi[3], wo[3], rgb[3];
    direction(theta_rad, 0, wi);
    for (int i = 0; i < N_THETA; i++)
        for (int j = 0; j < N_PHI; j++) {
            const double theta = M_PI * ((i + 0.5) / N_THETA - 0.5), phi = M_PI * (j + 0.5) / N_PHI;
            direction(theta, phi, wo);
            m->eval(s, wi, wo, rgb, NULL);
            const double light = pow(cos(theta), 2) * (double)rgb[1];
            sum += light;
            if (phi < M_PI_2) back += light;
        }
    return back / sum;
}

/* Light sent back rises towards grazing angles along the fiber as the solver has it for the middle of the green
 * channel, in the mean over some sizes; v1 sent back as much at every angle. */
static void light_sent_back(void **unused)
{
    (void)unused;
    enum { N_THETA = 5, N_SIZE = 5 };
    static const double theta_deg[N_THETA] = {0, 40, 60, 70, 80};
    const double param[5] = {0.999, 0.999, 0.999, 2 * RAD_PER_DEG, 8 * RAD_PER_DEG};
    for (int k = 0; k < 3; k++) {
        const struct wave_section *section = &wave_sections[k];
        char id[40];
        snprintf(id, sizeof id, "wave_%s.v2", section->name);
        const struct scattering_model *m = scattering_find(id);
        struct scattering_state *s = NULL;
        struct error err = {0};
        struct wave_outline o;
        double first = 0, last = 0;
        outline_of(section, &o);
        if (k == 2) wave_outline_turn_quarter(&o); /* so that the solver finds its mirror */
        if (m->prepare(param, &s, &err) != STATUS_OK) fail_msg("%s", err.text);
        for (int t = 0; t < N_THETA; t++) {
            const double theta = theta_deg[t] * RAD_PER_DEG;
            double want = 0, weights = 0;
            for (int i = 0; i < N_SIZE && (k == 0 || t % 2 == 0); i++) {
                const double z = 4.0 * i / (N_SIZE - 1) - 2, weight = exp(-0.5 * z * z);
                struct wave_mean mean;
                solve_mean(&o, 2 * M_PI * section->radius_m / wave_length_m[1] * exp(WAVE_TABLE_SPREAD * z),
                           section->index, 0.999, theta, &mean);
                for (int j = 0; j < WAVE_MEAN_N_ANGLE; j++) {
                    const int beyond = abs(WAVE_MEAN_N_ANGLE / 2 - j) - WAVE_MEAN_N_ANGLE / 4;
                    want += weight * mean.density[j] *
                            (beyond < 0    ? 1
                             : beyond == 0 ? 0.5
                                           : 0) *
                            2 * M_PI / WAVE_MEAN_N_ANGLE;
                }
                weights += weight;
            }
            last = model_back(m, s, theta);
            if (t == 0) first = last;
            if (weights == 0) continue;
            print_message("%s, %g degrees: %.4f sent back, by the solver %.4f\n", id, theta_deg[t], last,
                          want / weights);
            assert_true(fabs(last - want / weights) < 0.02);
        }
        assert_true(last > first + 0.1);
        m->release(s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(waves_against_rays), cmocka_unit_test(table_of_silk),
                                       cmocka_unit_test(weights_between_values),
                                       cmocka_unit_test(lossless_from_both_sides), cmocka_unit_test(light_sent_back)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
