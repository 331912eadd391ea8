/* The boundary-element solver of waves at an angle to the fiber: against the exact circular cylinder, the solver for
 * waves across the fiber, by the energy and by reciprocity; the light that a circle sends back.
 */
#include "base/angle.h"
#include "renderer/scattering/models/wave/solver/wave_mean.h"
#include "tests/support/wave/circle_amplitudes.h"

#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { N_PAIR = WAVE_N_FIELD * WAVE_N_FIELD };

static struct oblique_solver *solved(const struct oblique_problem *p, const double *angle_rad, size_t n)
{
    struct oblique_solver *s = NULL;
    struct error err = {0};
    if (oblique_solver_new(p, &s, &err) != STATUS_OK || oblique_solver_solve(s, angle_rad, n, &err) != STATUS_OK)
        fail_msg("%s", err.text);
    return s;
}

static void published_cross_sections(void **unused)
{
    (void)unused;
    assert_true(mie_oblique_published_error() < 1e-11); /* they have 12 digits */
}

/* ---- the circle ---- */

/* Largest errors of amplitudes over the largest one, of extinction, and of absorption over extinction. */
static void circle_errors(double x, double complex m, double theta_rad, double turn, double worst[3])
{
    static struct mie_oblique mie;
    const double angle = 0.7;
    struct wave_outline circle;
    wave_outline_ellipse(&circle, 2, 2); /* radius 2, so that units are not taken for granted */
    circle.forward[1] *= cexp(I * turn);
    const struct oblique_problem p = {&circle, x / 2, m, theta_rad, wave_solver_nodes(&circle, x / 2, creal(m), 4)};
    struct oblique_solver *s = solved(&p, &angle, 1);
    assert_true(oblique_solver_is_symmetric(s) == (turn == 0));
    assert_int_equal(mie_oblique_init(&mie, x, m, theta_rad), 0);
    worst[0] = fmax(worst[0], circle_amplitude_error(s, &mie, angle));
    for (int field = 0; field < WAVE_N_FIELD; field++) { /* widths of a diameter of 4 */
        const double ext = 4 * mie_oblique_extinction(&mie, (enum mie_field)field),
                     sca = 4 * mie_oblique_scattering(&mie, (enum mie_field)field);
        worst[1] = fmax(worst[1], fabs(oblique_solver_extinction(s, (enum wave_field)field, 0) / ext - 1));
        worst[2] = fmax(worst[2], fabs(oblique_solver_absorption(s, (enum wave_field)field, 0) - (ext - sca)) / ext);
    }
    oblique_solver_free(s);
}

static void circle(void **unused)
{
    (void)unused;
    static const struct {
        double x;
        double complex m;
        double turn; /* without a mirror when not 0 */
    } body[] = {
        {0.5, 1.5, 0}, {5.213, 1.55, 0.3}, {10, 1.55 + 0.1 * I, 0}, {40, 1.549, 0.3}, {60, 1.55 + 0.001 * I, 0}};
    static const double theta_deg[] = {0, 40, -60, 80, 85, 87};
    for (size_t k = 0; k < sizeof body / sizeof *body; k++)
        for (size_t t = 0; t < sizeof theta_deg / sizeof *theta_deg; t++) {
            double worst[3] = {0};
            circle_errors(body[k].x, body[k].m, theta_deg[t] * RAD_PER_DEG, body[k].turn, worst);
            print_message("x = %5.2f, m = %.3f + %.3f i, %3g degrees: amplitudes %.1e, extinction %.1e, "
                          "absorption %.1e\n",
                          body[k].x, creal(body[k].m), cimag(body[k].m), theta_deg[t], worst[0], worst[1], worst[2]);
            /* rounding grows with 1 / cos^4, 9e-13 at 80 degrees and 1.1e-10 at 87, by the order of sums of the BLAS */
            const double rounding = 10 * DBL_EPSILON / pow(cos(theta_deg[t] * RAD_PER_DEG), 4);
            for (int i = 0; i < 3; i++) assert_true(worst[i] < fmax(1e-10, rounding));
        }
}

/* Unpolarised light that the exact circle sends into the half in front of it, over that which falls on its width. */
static double exact_back(double x, double index, double theta_rad)
{
    enum { N = 360 };
    static struct mie_oblique mie;
    double back = 0;
    assert_int_equal(mie_oblique_init(&mie, x, index, theta_rad), 0);
    for (int j = 0; j < N; j++) { /* both sides of the circle alike */
        const double d = M_PI_2 * (1 + (j + 0.5) / N);
        for (int pair = 0; pair < N_PAIR; pair++)
            back +=
                pow(cabs(mie_oblique_amplitude(&mie, (enum mie_field)(pair / 2), (enum mie_field)(pair % 2), d)), 2);
    }
    return back / (2.0 * N * x * cos(theta_rad));
}

/* The same by the mean that tables are made of: the two directions at the sides belong to both halves, and the shadow
 * has hardly any light there. */
static double mean_back(const struct wave_mean *mean)
{
    double back = 0;
    for (int j = 0; j < WAVE_MEAN_N_ANGLE; j++) {
        const int beyond = abs(WAVE_MEAN_N_ANGLE / 2 - j) - WAVE_MEAN_N_ANGLE / 4;
        back += mean->density[j] * (beyond < 0 ? 1 : beyond == 0 ? 0.5 : 0) * 2 * M_PI / WAVE_MEAN_N_ANGLE;
    }
    return back * mean->met;
}

/* Light sent back by a circle as large as silk: of one size by the mean that tables are made of, against the exact
 * circle; and of sizes as of wave_table.h, against an audit of the exact circle by independent code (green, index 1.55,
 * whose sizes are not stated). */
static void light_sent_back(void **unused)
{
    (void)unused;
    enum { N_THETA = 5, N_SIZE = 61 };
    static const double theta_deg[N_THETA] = {0, 40, 60, 70, 80}, audit[N_THETA] = {.097, .152, .240, .344, .522};
    const double x = 2 * M_PI * 4.7 / 0.55, index = 1.55;
    struct wave_outline circle;
    wave_outline_ellipse(&circle, 1, 1);
    for (int t = 0; t < N_THETA; t++) {
        const double theta = theta_deg[t] * RAD_PER_DEG;
        const struct oblique_problem p = {&circle, x, index, theta, wave_solver_nodes(&circle, x, index, 4)};
        struct wave_mean mean;
        struct error err = {0};
        if (wave_mean_over_turns(&p, &mean, &err) != STATUS_OK) fail_msg("%s", err.text);
        const double one = mean_back(&mean), exact = exact_back(x, index, theta);
        double sum = 0, weights = 0;
        for (int i = 0; i < N_SIZE; i++) {
            const double z = 6.0 * i / (N_SIZE - 1) - 3, weight = exp(-0.5 * z * z);
            weights += weight;
            sum += weight * exact_back(x * exp(0.1077 * z), index, theta);
        }
        print_message("%g degrees: one size %.5f, exact %.5f; all sizes %.4f, audit %.3f\n", theta_deg[t], one, exact,
                      sum / weights, audit[t]);
        assert_true(fabs(one - exact) < 1e-3 * exact);
        assert_true(fabs(sum / weights - audit[t]) < 0.012);
    }
}

/* ---- any outline ---- */

enum { N_OUTLINE = 3 };

static void outline_of(int i, struct wave_outline *o)
{
    if (i == 0) wave_outline_bean(o, 1.6, 0.7, 0.3); /* without a mirror about the x axis */
    if (i == 1) wave_outline_lobed(o, 1, 3, 0.3);    /* with one */
    if (i == 2) {
        wave_outline_lobed(o, 1, 3, 0.2); /* without any mirror */
        o->backward[1] = 0.16 * cexp(0.4 * I);
    }
}

/* Across the fiber the fields are independent and equal those of the other solver. */
static void across_the_fiber(void **unused)
{
    (void)unused;
    static const double angle[2] = {0.4, 2.5};
    const double complex index = 1.55 + 0.003 * I;
    for (int i = 0; i < N_OUTLINE; i++) {
        struct wave_outline o;
        double worst = 0, top = 0;
        outline_of(i, &o);
        const size_t n = wave_solver_nodes(&o, 15, 1.55, 4);
        const struct oblique_problem p = {&o, 15, index, 0, n};
        struct oblique_solver *s = solved(&p, angle, 2);
        for (int field = 0; field < WAVE_N_FIELD; field++) {
            const struct wave_problem q = {&o, 15, index, (enum wave_field)field, n};
            struct wave_solver *across = NULL;
            struct error err = {0};
            if (wave_solver_new(&q, &across, &err) != STATUS_OK ||
                wave_solver_solve(across, angle, 2, &err) != STATUS_OK)
                fail_msg("%s", err.text);
            for (int j = 0; j < 90; j++) {
                double complex t[N_PAIR * 2];
                oblique_solver_towards(s, 0.07 * j, t);
                for (size_t w = 0; w < 2; w++) {
                    const double complex want = wave_solver_amplitude(across, w, 0.07 * j);
                    worst = fmax(worst, cabs(t[(size_t)field * 3 * 2 + w] - want)); /* pairs 0 and 3 */
                    worst = fmax(worst, cabs(t[(size_t)(1 + field) * 2 + w]));      /* pairs 1 and 2 */
                    top = fmax(top, cabs(want));
                }
            }
            wave_solver_free(across);
        }
        oblique_solver_free(s);
        print_message("outline %d: %.1e from the solver of waves across\n", i, worst / top);
        assert_true(worst < 1e-9 * top);
    }
}

/* Both polarisations scatter, and absorb, what they extinguish. Light that goes back the way it came meets the same
 * amplitudes, with both fields exchanged. */
static void energy_and_reciprocity(void **unused)
{
    (void)unused;
    enum { N_ANGLE = 400 };
    static const double a = 0.4, b = 2.3, theta_deg[2] = {35, 78};
    const double angle[2] = {a, b + M_PI};
    for (int i = 0; i < N_OUTLINE; i++)
        for (int k = 0; k < 4; k++) {
            struct wave_outline o;
            double scattered[WAVE_N_FIELD] = {0}, off = 0, mirrored = 0;
            outline_of(i, &o);
            const struct oblique_problem p = {&o, 20, k < 2 ? 1.5 : 1.55 + 0.01 * I, theta_deg[k % 2] * RAD_PER_DEG,
                                              wave_solver_nodes(&o, 20, 1.55, 4)};
            struct oblique_solver *s = solved(&p, angle, 2);
            double complex t[N_PAIR * 2], there[N_PAIR * 2], back[N_PAIR * 2];
            for (int j = 0; j < N_ANGLE; j++) {
                oblique_solver_towards(s, 2 * M_PI * j / N_ANGLE, t);
                for (int pair = 0; pair < N_PAIR; pair++)
                    scattered[pair % WAVE_N_FIELD] +=
                        4 / (p.k * cos(p.theta_rad)) * pow(cabs(t[2 * pair]), 2) / N_ANGLE;
            }
            for (int field = 0; field < WAVE_N_FIELD; field++) {
                const double ext = oblique_solver_extinction(s, (enum wave_field)field, 0),
                             absorbed = oblique_solver_absorption(s, (enum wave_field)field, 0);
                off = fmax(off, fabs(scattered[field] + absorbed - ext) / ext);
                assert_true(k < 2 ? fabs(absorbed) < 1e-9 * ext : absorbed > 0.05 * ext);
            }
            oblique_solver_towards(s, b, there);
            oblique_solver_towards(s, a + M_PI, back);
            oblique_solver_free(s);
            for (int to = 0; to < WAVE_N_FIELD; to++)
                for (int from = 0; from < WAVE_N_FIELD; from++)
                    mirrored = fmax(mirrored, cabs(there[(to * 2 + from) * 2] - back[(from * 2 + to) * 2 + 1]));
            print_message("outline %d, %g degrees: energy %.1e, reciprocity %.1e\n", i, theta_deg[k % 2], off,
                          mirrored / cabs(t[0]));
            assert_true(off < 1e-8 && mirrored < 1e-7);
        }
}

/* ---- problems that are refused ---- */

static void refused_problems(void **unused)
{
    (void)unused;
    struct wave_outline o;
    wave_outline_ellipse(&o, 1, 1);
    const struct {
        struct oblique_problem problem;
        const char *field;
    } bad[] = {{{&o, 10, 1.5, M_PI_2, 64}, "theta"},
               {{&o, 10, 1.5, NAN, 64}, "theta"},
               {{&o, -1, 1.5, 0, 64}, "k"},
               {{&o, 10, 1.5 - 0.1 * I, 0, 64}, "index"},
               {{&o, 10, 1.5, 0, 65}, "n_node"}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct oblique_solver *s = NULL;
        struct error err = {0};
        assert_int_equal(oblique_solver_new(&bad[i].problem, &s, &err), STATUS_INVALID);
        assert_string_equal(err.field, bad[i].field);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(published_cross_sections), cmocka_unit_test(circle),
                                       cmocka_unit_test(light_sent_back),          cmocka_unit_test(across_the_fiber),
                                       cmocka_unit_test(energy_and_reciprocity),   cmocka_unit_test(refused_problems)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
