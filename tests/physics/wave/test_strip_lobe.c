/* Light that a fiber diffracts: the lobe of a strip against its closed forms, and dielectric_diffraction.v1 against
 * the exact cylinder of Lorenz and Mie. test_mie_cylinder.c compares the lobe of one wavelength with it.
 */
#include "base/angle.h"
#include "renderer/scattering/models/dielectric/strip_lobe.h"
#include "tests/support/model/fiber_angles.h"
#include "tests/support/model/model_furnace.h"
#include "tests/support/wave/mie_cylinder.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

#include "tests/support/model/prepared_model.h"

/* Integral of J_0 over [0, z]. */
static double bessel_integral(double z)
{
    enum { N = 20000 };
    double sum = 0;
    for (int i = 0; i <= N; i++) sum += j0(z * i / N) * (i == 0 || i == N ? 1 : i % 2 == 1 ? 4 : 2);
    return sum * z / (3 * N);
}

/* The integral of A sinc^2(A sin d) over the half in front is that of J_0 up to 2 pi A less J_1(2 pi A), since the
 * second derivative of A times it by 2 pi A is a multiple of J_0. At the nodes of the table, between which c of one
 * wavelength swings. A sinc^2 itself by values with eight digits, at 0.5 and 2 degrees; c is read within 1e-3 there.
 * */
static void one_wavelength(void **unused)
{
    (void)unused;
    static const double golden[2][3] = {{20, 18.074387, 2.747299}, {14.142135623730951, 13.447577, 5.879884}};
    struct strip_lobe lobe;
    strip_lobe_init(&lobe, 0);
    for (int i = 3; i < STRIP_LOBE_N - 4; i += 25) {
        const double a = i / (double)(STRIP_LOBE_N - i), c = bessel_integral(2 * M_PI * a) - j1(2 * M_PI * a);
        const double peak = strip_lobe_eval(&lobe, a, 0, NULL);
        if (!(fabs(peak * c / a - 1) < 1e-7)) fail_msg("A = %g: %g, in closed form %g", a, peak, a / c);
    }
    for (int k = 0; k < 2; k++) {
        const double a = golden[k][0], c = bessel_integral(2 * M_PI * a) - j1(2 * M_PI * a);
        for (int i = 0; i < 2; i++) {
            const double sine = sin((i == 0 ? 0.5 : 2) * RAD_PER_DEG);
            assert_true(fabs(strip_lobe_eval(&lobe, a, sine, NULL) * c / golden[k][1 + i] - 1) < 1e-3);
        }
    }
}

/* The table of c is read by straight lines, with an error of 1e-4 at most. Samples have a weight of at most 1 / 0.3.
 * */
static void integral_slope_and_density(void **unused)
{
    (void)unused;
    enum { N = 4000 };
    struct strip_lobe lobe;
    strip_lobe_init(&lobe, 0.075);
    for (double a = 0.003; a < 80; a *= 1.6) {
        double sum = 0, drawn = 0, least = INFINITY;
        for (int i = 0; i < N; i++) {
            const double d = ((i + 0.5) / N - 0.5) * M_PI;
            const double f = strip_lobe_eval(&lobe, a, sin(fabs(d)), NULL), p = strip_lobe_density(a, tan(d / 2));
            sum += f * M_PI / N;
            drawn += p * M_PI / N;
            least = fmin(least, p / f);
        }
        if (!(fabs(sum - 1) < 2e-4 && fabs(drawn - 1) < 1e-5 && least > 0.3))
            fail_msg("A = %g: integral %g, of the samples %g, least ratio %g", a, sum, drawn, least);
        for (double y = 0; y < 60; y = 1.7 * y + 1e-4) { /* straight lines have a slope of their own: off by 1e-3 */
            const double sine = y / (M_PI * a), h = 1e-5;
            double slope;
            if (sine > 1) break;
            strip_lobe_eval(&lobe, a, sine, &slope);
            const double up = strip_lobe_eval(&lobe, a * (1 + h), sine, NULL),
                         down = strip_lobe_eval(&lobe, a * (1 - h), sine, NULL);
            if (!(fabs(log(up / down) / (2 * h) - slope) < 1e-4 * (1 + fabs(slope)) + 1e-3))
                fail_msg("A = %g, y = %g: slope %g, difference %g", a, y, slope, log(up / down) / (2 * h));
        }
    }
}

/* The integral of the density up to a sample is the number that the sample was drawn with. */
static void samples_follow_the_lorentz_curve(void **unused)
{
    (void)unused;
    enum { N = 20000 };
    for (double a = 1e-3; a < 80; a *= 3) {
        double below = 0;
        for (int i = 0; i < N; i++) { /* from d of i / N to that of (i + 1) / N, by the trapezoidal rule */
            const double t = strip_lobe_sample(a, (double)i / N), next = strip_lobe_sample(a, (i + 1.0) / N);
            below += (strip_lobe_density(a, t) + strip_lobe_density(a, next)) * (atan(next) - atan(t));
            assert_true(fabs(below - (i + 1.0) / N) < 1e-4);
        }
    }
}

/* All light leaves from both sides, over the range of the parameters; C_T = 0.999 absorbs at most 0.2 %. */
static void energy_from_both_sides(void **unused)
{
    (void)unused;
    static const double theta_deg[4] = {0, -40, 75, 88};
    const struct scattering_model *m = scattering_find("dielectric_diffraction.v1");
    for (int k = 0; k < 3; k++) {
        double param[SCATTERING_MAX_PARAM];
        for (size_t p = 0; p < m->n_param; p++) {
            const struct param_info *i = &m->param[p];
            param[p] = i->channel >= 0 ? i->upper : k == 0 ? i->start : k == 1 ? i->upper : i->lower;
        }
        struct scattering_state *s = prepare(m, param);
        for (int t = 0; t < 4; t++)
            for (int side = 0; side < 2;
                 side++) { /* fringes have waves up to 2 pi A, and a quarter more at the end of the band */
                const struct model_furnace q = {.n_theta = 720, .n_phi = k == 1 ? 430 : 220};
                double sum[3];
                model_furnace(m, s, &q, theta_deg[t] * RAD_PER_DEG, side == 0, sum);
                if (!(sum[0] < 1 + 1e-3 && sum[0] > 1 - 3e-3))
                    fail_msg("set %d, %g degrees, side %d: %.5f", k, theta_deg[t], side, sum[0]);
            }
        m->release(s);
    }
}

/* ---- the exact cylinder ---- */

enum { N_BAND = 33, N_CURVE = 96 };
static const double green_um = 0.5491, unit_um = 0.55;

struct exact {
    double x; /* of the middle of the band */
    double weight[N_BAND];
    struct mie_cylinder *wave[N_BAND][2];
};

/* The band of the model, in wave numbers; a fiber that absorbs all that enters. */
static void exact_init(struct exact *e, double diameter)
{
    double sum = 0;
    e->x = M_PI * diameter * unit_um / green_um;
    for (int i = 0; i < N_BAND; i++) {
        const double z = 8.0 * i / (N_BAND - 1) - 4, k = 1 + 0.075 * z;
        sum += exp(-0.5 * z * z);
        e->weight[i] = exp(-0.5 * z * z) * k;
        for (int f = 0; f < 2; f++) {
            assert_non_null(e->wave[i][f] = malloc(sizeof *e->wave[i][f]));
            assert_int_equal(
                mie_cylinder_init(e->wave[i][f], e->x * k, 1.55 + 0.05 * I, f == 0 ? MIE_ALONG : MIE_ACROSS), 0);
        }
    }
    for (int i = 0; i < N_BAND; i++) e->weight[i] /= sum;
}

static void exact_release(struct exact *e)
{
    for (int i = 0; i < N_BAND; i++)
        for (int f = 0; f < 2; f++) free(e->wave[i][f]);
}

/* Light scattered into the azimuth d from straight on, over that which falls on twice the diameter. */
static double exact_at(const struct exact *e, double d)
{
    double sum = 0;
    for (int i = 0; i < N_BAND; i++)
        for (int f = 0; f < 2; f++) {
            const double a = cabs(mie_amplitude(e->wave[i][f], d));
            sum += 0.5 * e->weight[i] * a * a / (2 * M_PI * e->wave[i][f]->x);
        }
    return sum;
}

/* The same by the model: S of light across the fiber, over all th_o. */
static double model_at(const struct scattering_model *m, const struct scattering_state *s, double d)
{
    enum { N = 360 };
    float wi[3], wo[3], rgb[3];
    double sum = 0;
    direction(0, 0, wi);
    for (int i = 0; i < N; i++) {
        const double theta = M_PI * ((i + 0.5) / N - 0.5);
        direction(theta, M_PI + d, wo);
        m->eval(s, wi, wo, rgb, NULL);
        sum += (double)rgb[1] * pow(cos(theta), 2) * M_PI / N;
    }
    return sum;
}

/* Peak, angle at which half of it is left, and light up to the place of the first zero of one wavelength. */
static void lobe_of(const double curve[N_CURVE], double step, double a, double lobe[3])
{
    lobe[0] = curve[0];
    lobe[1] = lobe[2] = 0;
    for (int i = 0; i + 1 < N_CURVE; i++) {
        if (lobe[1] == 0 && curve[i + 1] < 0.5 * curve[0])
            lobe[1] = step * (i + (curve[i] - 0.5 * curve[0]) / (curve[i] - curve[i + 1]));
        if (step * (i + 1) <= asin(1 / a)) lobe[2] += (curve[i] + curve[i + 1]) * step;
    }
}

/* The edges of a large cylinder add the part 0.498 x^(-2/3) to the width that casts the shadow (test_mie_cylinder.c;
 * an absorbing one for both polarisations alike): the lobe is as much narrower, has as much more light and twice as
 * much more at its peak. The next term is of the order x^(-4/3). */
static void forward_lobe_of_the_exact_cylinder(void **unused)
{
    (void)unused;
    static const double diameter[3] = {10, 25, 60}, power[3] = {2, -1, 1};
    static const char *const name[3] = {"peak", "half width", "light"};
    const struct scattering_model *m = scattering_find("dielectric_diffraction.v1");
    for (int k = 0; k < 3; k++) {
        const double param[8] = {0.001, 0.001, 0.001, 1.55, 8 * RAD_PER_DEG, 4 * RAD_PER_DEG, diameter[k], RAD_PER_DEG};
        const double a = diameter[k] * unit_um / green_um, step = 1.2 / (a * N_CURVE);
        double curve[2][N_CURVE], lobe[2][3];
        struct scattering_state *s = prepare(m, param);
        struct exact e;
        exact_init(&e, diameter[k]);
        for (int i = 0; i < N_CURVE; i++) {
            curve[0][i] = model_at(m, s, step * i);
            curve[1][i] = exact_at(&e, step * i);
        }
        for (int i = 0; i < 2; i++) lobe_of(curve[i], step, a, lobe[i]);
        for (int i = 0; i < 3; i++) {
            const double q = pow(e.x, -2.0 / 3), ratio = lobe[1][i] / lobe[0][i], edge = pow(1 + 0.498 * q, power[i]);
            print_message("diameter %g, %s: %.5g, exact %.5g, ratio %.4f, by the edges %.4f\n", diameter[k], name[i],
                          lobe[0][i], lobe[1][i], ratio, edge);
            assert_true(fabs(ratio / edge - 1) < q * q);
        }
        exact_release(&e);
        m->release(s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_wavelength),
        cmocka_unit_test(integral_slope_and_density),
        cmocka_unit_test(samples_follow_the_lorentz_curve),
        cmocka_unit_test(energy_from_both_sides),
        cmocka_unit_test(forward_lobe_of_the_exact_cylinder),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
