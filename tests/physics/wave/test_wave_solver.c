/* The boundary-element solver of waves: against the exact circular cylinder, by the energy, by reciprocity, and by its
 * own convergence; outlines from points.
 */
#include "renderer/scattering/models/wave/solver/cylinder_functions.h"
#include "renderer/scattering/models/wave/solver/wave_solver.h"
#include "tests/support/scratch_folder.h"
#include "tests/support/wave/mie_cylinder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static struct wave_solver *solved(const struct wave_problem *p, const double *angle_rad, size_t n)
{
    struct wave_solver *s = NULL;
    struct error err = {0};
    if (wave_solver_new(p, &s, &err) != STATUS_OK || wave_solver_solve(s, angle_rad, n, &err) != STATUS_OK)
        fail_msg("%s", err.text);
    return s;
}

/* ---- parts ---- */

/* Wronskian of J and H, which is 2 i / (pi z) wherever their sizes are, and real arguments against libm. */
static void cylinder_functions(void **unused)
{
    (void)unused;
    double worst = 0, worst_real = 0;
    for (double size = 1e-3; size < 400; size *= 1.07)
        for (int k = 0; k <= 4; k++) {
            const double complex z = size + I * fmin(0.25 * k * size, 0.7 * k);
            struct cylinder_functions f;
            cylinder_functions_at(z, &f);
            const double complex w = (f.j[1] * f.h[0] - f.j[0] * f.h[1]) * M_PI * z / (2 * I);
            worst = fmax(worst, cabs(w - 1));
            if (k > 0) continue;
            const double want[4] = {j0(size), y0(size), j1(size), y1(size)};
            for (int i = 0; i < 4; i++) {
                const double got = i % 2 == 0 ? creal(f.j[i / 2]) : cimag(f.h[i / 2]);
                worst_real = fmax(worst_real, fabs(got - want[i]) / cabs(f.h[i / 2]));
            }
        }
    print_message("Wronskian to %.1e, real arguments to %.1e\n", worst, worst_real);
    assert_true(worst < 1e-11 && worst_real < 1e-13);
}

/* ---- the circle ---- */

/* Largest errors of extinction, scattering, absorption, relative, and of |T|^2 over its largest outside of the forward
 * direction. */
static void circle_errors(double x, double complex m, double per_wave, double worst[4])
{
    enum { N_ANGLE = 720 };
    static struct mie_cylinder mie;
    struct wave_outline circle;
    wave_outline_ellipse(&circle, 2, 2); /* radius 2, so that units are not taken for granted */
    for (int field = 0; field < WAVE_N_FIELD; field++) {
        const double angle = 0.7;
        const struct wave_problem p = {&circle, x / 2, m, (enum wave_field)field,
                                       wave_solver_nodes(&circle, x / 2, creal(m), per_wave)};
        struct wave_solver *s = solved(&p, &angle, 1);
        double complex t[N_ANGLE];
        wave_solver_amplitudes(s, 0, t, N_ANGLE);
        assert_int_equal(mie_cylinder_init(&mie, x, m, field == WAVE_ALONG ? MIE_ALONG : MIE_ACROSS), 0);
        const double ext = 4 * mie_extinction(&mie), sca = 4 * mie_scattering(&mie);
        worst[0] = fmax(worst[0], fabs(wave_solver_extinction(s, 0) / ext - 1));
        worst[1] = fmax(worst[1], fabs(wave_scattering_of(x / 2, t, N_ANGLE) / sca - 1));
        worst[2] = fmax(worst[2], fabs(wave_solver_absorption(s, 0) - (ext - sca)) / ext);
        double off = 0, top = 0;
        for (int j = 0; j < N_ANGLE; j++) {
            const double complex want = mie_amplitude(&mie, 2 * M_PI * j / N_ANGLE - angle);
            off = fmax(off, cabs(t[j] - want));
            top = fmax(top, cabs(want));
        }
        worst[3] = fmax(worst[3], off / top);
        wave_solver_free(s);
    }
}

static void circle(void **unused)
{
    (void)unused;
    static const struct {
        double x;
        double complex m;
    } body[] = {{0.3, 1.5},  {5.213, 1.55},          {10, 1.55 + 0.1 * I},
                {40, 1.549}, {60, 1.33 + 0.001 * I}, {100, 1.55 + 0.002 * I}};
    for (size_t k = 0; k < sizeof body / sizeof *body; k++) {
        double worst[4] = {0};
        circle_errors(body[k].x, body[k].m, 4, worst);
        print_message(
            "x = %5.2f, m = %.3f + %.3f i: extinction %.1e, scattering %.1e, absorption %.1e, amplitude %.1e\n",
            body[k].x, creal(body[k].m), cimag(body[k].m), worst[0], worst[1], worst[2], worst[3]);
        for (int i = 0; i < 4; i++) assert_true(worst[i] < 1e-9);
    }
}

/* ---- any outline ---- */

enum { N_OUTLINE = 4 };

static void outline_of(int i, struct wave_outline *o)
{
    if (i == 0) wave_outline_ellipse(o, 1.5, 0.6);
    if (i == 1) wave_outline_lobed(o, 1, 3, 0.2); /* trilobal: its outline is concave between the lobes */
    if (i == 2) wave_outline_bean(o, 1.7, 0.6, 0.4);
    if (i == 3) wave_outline_lobed(o, 1, 3, 0.08); /* a rounded triangle */
    wave_outline_scale(o, 1 / sqrt(wave_outline_area(o) / M_PI));
}

/* Extinction, by the amplitude straight on, is scattering, by the amplitudes all around, and absorption, by the flux
 * through the outline: three different sums. */
static void energy(void **unused)
{
    (void)unused;
    enum { N_ANGLE = 360, N_WAVE = 3 };
    static const double angle[N_WAVE] = {0, 0.5, 2};
    static const double complex index[2] = {1.5, 1.5 + 0.01 * I};
    const double k = 25;
    double worst = 0;
    for (int i = 0; i < N_OUTLINE; i++)
        for (int m = 0; m < 2; m++) {
            struct wave_outline o;
            outline_of(i, &o);
            const size_t n = wave_solver_nodes(&o, k, 1.5, 4);
            const struct wave_problem p = {&o, k, index[m], i % 2 == m ? WAVE_ALONG : WAVE_ACROSS, n};
            struct wave_solver *s = solved(&p, angle, N_WAVE);
            for (size_t w = 0; w < N_WAVE; w++) {
                double complex t[N_ANGLE];
                wave_solver_amplitudes(s, w, t, N_ANGLE);
                const double absorbed = wave_solver_absorption(s, w), ext = wave_solver_extinction(s, w);
                worst = fmax(worst, fabs(wave_scattering_of(k, t, N_ANGLE) + absorbed - ext) / ext);
                assert_true(m == 0 ? fabs(absorbed) < 1e-9 * ext : absorbed > 0.1 * ext);
            }
            wave_solver_free(s);
        }
    print_message("energy to %.1e\n", worst);
    assert_true(worst < 1e-9);
}

/* Light that goes back the way it came meets the same amplitude. */
static void reciprocity(void **unused)
{
    (void)unused;
    double worst = 0;
    for (int i = 0; i < N_OUTLINE; i++)
        for (int field = 0; field < WAVE_N_FIELD; field++) {
            static const double a = 0.4, b = 2.3;
            const double angle[2] = {a, b + M_PI};
            struct wave_outline o;
            outline_of(i, &o);
            const struct wave_problem p = {&o, 15, 1.55 + 0.003 * I, (enum wave_field)field,
                                           wave_solver_nodes(&o, 15, 1.55, 4)};
            struct wave_solver *s = solved(&p, angle, 2);
            const double complex there = wave_solver_amplitude(s, 0, b), back = wave_solver_amplitude(s, 1, a + M_PI);
            worst = fmax(worst, cabs(there - back) / cabs(wave_solver_amplitude(s, 0, a)));
            wave_solver_free(s);
        }
    print_message("reciprocity to %.1e\n", worst);
    assert_true(worst < 1e-8);
}

/* Amplitudes with more and more nodes, against twice as many as the most: the error falls faster than any power. */
static void convergence(void **unused)
{
    (void)unused;
    enum { N_ANGLE = 90, N_STEP = 4 };
    static const double per_wave[N_STEP] = {2, 3, 4, 5}, most[N_STEP] = {0.1, 3e-3, 1e-9, 1e-12};
    for (int i = 0; i < N_OUTLINE; i++) {
        const double k = 25, angle = 0.3;
        double complex exact[N_ANGLE], t[N_ANGLE];
        double top = 0;
        struct wave_outline o;
        outline_of(i, &o);
        for (int step = N_STEP; step >= 0; step--) {
            const size_t n = wave_solver_nodes(&o, k, 1.55, step == N_STEP ? 10 : per_wave[step]);
            const struct wave_problem p = {&o, k, 1.55, i % 2 == 0 ? WAVE_ALONG : WAVE_ACROSS, n};
            struct wave_solver *s = solved(&p, &angle, 1);
            wave_solver_amplitudes(s, 0, step == N_STEP ? exact : t, N_ANGLE);
            wave_solver_free(s);
            double off = 0;
            for (int j = 0; j < N_ANGLE; j++) {
                if (step == N_STEP)
                    top = fmax(top, cabs(exact[j]));
                else
                    off = fmax(off, cabs(t[j] - exact[j]) / top);
            }
            if (step == N_STEP) continue;
            print_message("outline %d, %g nodes a wave (%zu): %.1e\n", i, per_wave[step], n, off);
            assert_true(off < most[step]);
        }
    }
}

/* ---- outlines ---- */

static void outlines_from_points(void **unused)
{
    (void)unused;
    enum { N = 500 };
    double xy[N][2];
    struct wave_outline o, bean;
    struct error err = {0};
    wave_outline_bean(&bean, 1.6, 0.7, 0.3);
    for (int i = 0; i < N; i++) { /* clockwise, to be turned over */
        const double complex z = wave_outline_at(&bean, -2 * M_PI * i / N, NULL, NULL);
        xy[i][0] = creal(z);
        xy[i][1] = cimag(z);
    }
    double before = INFINITY; /* Lanczos' factors move the outline by its curvature over the square of the waves */
    for (int n_wave = 15; n_wave <= 60; n_wave *= 2) {
        assert_int_equal(wave_outline_from_points(&o, xy[0], N, n_wave, &err), STATUS_OK);
        double off = fabs(wave_outline_area(&o) / wave_outline_area(&bean) - 1);
        for (int k = 0; k < 8; k++) {
            double got[2], want[2];
            wave_outline_extent(&o, 0.4 * k, got);
            wave_outline_extent(&bean, 0.4 * k, want);
            off = fmax(off, fabs(got[1] - got[0] - (want[1] - want[0]))); /* the two are centered by other means */
        }
        print_message("%d waves: off by %.4f\n", n_wave, off);
        assert_true(off < 0.4 * before);
        before = off;
    }
    assert_true(before < 0.01);
    static const double eight[4][2] = {{0, 0}, {1, 1}, {1, 0}, {0, 1.5}}, flat[3][2] = {{0, 0}, {1, 0}, {2, 0}};
    assert_int_equal(wave_outline_from_points(&o, eight[0], 4, 20, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "meets itself"));
    assert_int_equal(wave_outline_from_points(&o, flat[0], 3, 20, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "no area"));
    assert_int_equal(wave_outline_from_points(&o, flat[0], 2, 20, &err), STATUS_INVALID);
    xy[3][1] = NAN;
    assert_int_equal(wave_outline_from_points(&o, xy[0], N, 40, &err), STATUS_INVALID);
    assert_non_null(strstr(err.text, "not finite"));
    wave_outline_lobed(&o, 1, 5, 3);
    assert_int_equal(wave_outline_check(&o, &err), STATUS_INVALID);
}

/* The width that an ellipse shows has a closed form; area and length of the Fourier series are those of the curve. */
static void measures_of_outlines(void **unused)
{
    (void)unused;
    struct wave_outline o;
    const double a = 1.7, b = 0.6;
    wave_outline_ellipse(&o, a, b);
    assert_true(fabs(wave_outline_area(&o) / (M_PI * a * b) - 1) < 1e-14);
    for (double angle = 0; angle < 3; angle += 0.17) {
        double range[2];
        wave_outline_extent(&o, angle, range);
        assert_true(fabs(range[1] - range[0] - 2 * hypot(a * sin(angle), b * cos(angle))) < 1e-9);
    }
    wave_outline_bean(&o, a, b, 0.3);
    assert_true(fabs(wave_outline_area(&o) / (M_PI * a * b) - 1) < 1e-14); /* bending keeps it */
}

static void outlines_from_files(void **state)
{
    static const struct {
        const char *text, *error;
    } file[] = {{"# silk\n0,0\n\n2, 0\n 1.0 ,1.5\n", NULL},
                {"0,0\n2,0\n1;1\n", "line 3 of outline"},
                {"0,0\n2,0\n1,1,1\n", "line 3 of outline"},
                {"0,0\n2,0\n", "needs 3 points, not 2"}};
    const char *path = scratch_path(state, "outline.csv");
    struct wave_outline o;
    struct error err = {0};
    for (size_t i = 0; i < sizeof file / sizeof *file; i++) {
        scratch_write(path, file[i].text, strlen(file[i].text));
        const status st = wave_outline_load(&o, path, 20, &err);
        assert_int_equal(st, file[i].error == NULL ? STATUS_OK : STATUS_INVALID);
        if (file[i].error != NULL) assert_non_null(strstr(err.text, file[i].error));
    }
    assert_int_equal(wave_outline_load(&o, scratch_path(state, "missing.csv"), 20, &err), STATUS_NOT_FOUND);
}

static void problems_that_are_refused(void **unused)
{
    (void)unused;
    struct wave_outline o;
    struct wave_solver *s = NULL;
    struct error err = {0};
    wave_outline_ellipse(&o, 1, 1);
    static const struct {
        double k;
        double complex index;
        size_t n;
        const char *field;
    } bad[] = {{0, 1.5, 64, "k"},          {10, 1.5 - 0.1 * I, 64, "index"}, {10, 0.1 * I, 64, "index"},
               {10, 1.5 + I, 64, "index"}, {10, 1.5, 65, "n_node"},          {10, 1.5, 20000, "n_node"},
               {NAN, 1.5, 64, "k"}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        const struct wave_problem p = {&o, bad[i].k, bad[i].index, WAVE_ALONG, bad[i].n};
        assert_int_equal(wave_solver_new(&p, &s, &err), STATUS_INVALID);
        assert_string_equal(err.field, bad[i].field);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cylinder_functions),
        cmocka_unit_test(circle),
        cmocka_unit_test(energy),
        cmocka_unit_test(reciprocity),
        cmocka_unit_test(convergence),
        cmocka_unit_test(outlines_from_points),
        cmocka_unit_test(measures_of_outlines),
        cmocka_unit_test_setup_teardown(outlines_from_files, scratch_folder_setup, scratch_folder_teardown),
        cmocka_unit_test(problems_that_are_refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
