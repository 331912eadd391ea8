/* The exact circular cylinder: published efficiencies, energy, what large cylinders extinguish, and their forward lobe.
 */
#include "tests/support/wave/mie_cylinder.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

static const enum mie_field fields[] = {MIE_ALONG, MIE_ACROSS};

static struct mie_cylinder *cylinder(double x, double complex m, enum mie_field field)
{
    struct mie_cylinder *c = malloc(sizeof *c);
    assert_non_null(c);
    assert_int_equal(mie_cylinder_init(c, x, m, field), 0);
    return c;
}

static void published_efficiencies(void **unused)
{
    (void)unused;
    assert_true(mie_published_error() < 1e-9); /* they have 12 digits */
}

/* A cylinder that does not absorb scatters what it extinguishes, one that absorbs less. The integral of the amplitudes
 * over all angles is the sum over the orders. */
static void energy(void **unused)
{
    (void)unused;
    for (int f = 0; f < 2; f++)
        for (double x = 0.1; x < 300; x *= 3.7) {
            struct mie_cylinder *c = cylinder(x, 1.549, fields[f]), *dark = cylinder(x, 1.549 + 0.01 * I, fields[f]);
            const double scattered = mie_scattering(c);
            assert_true(fabs(mie_extinction(c) / scattered - 1) < 1e-11);
            assert_true(mie_scattering(dark) < mie_extinction(dark));
            const size_t n = 2 * c->n_order + 2; /* exact for a polynomial of that degree in cos */
            double sum = 0;
            for (size_t k = 0; k < n; k++) {
                const double a = cabs(mie_amplitude(c, 2 * M_PI * (double)k / (double)n));
                sum += a * a * 2 * M_PI / (double)n;
            }
            assert_true(fabs(sum / (M_PI * x) / scattered - 1) < 1e-10);
            free(c);
            free(dark);
        }
}

/* Extinction of a large mirror is 2, with the published corrections of its edges (Bowman, Senior and Uslenghi 1969,
 * "Electromagnetic and Acoustic Scattering by Simple Shapes", section 2.2). */
static void extinction_of_large_cylinders(void **unused)
{
    static const double edge[2][3] = {{0.49807659, -0.01117656, -0.01468652}, {-0.43211998, -0.21371236, 0.05573255}};
    (void)unused;
    for (int f = 0; f < 2; f++)
        for (double x = 50; x < 3900; x *= 4) { /* below, a further term counts */
            struct mie_cylinder *mirror = cylinder(x, INFINITY, fields[f]);
            const double q = pow(x, -2.0 / 3);
            const double expected = 2 * (1 + edge[f][0] * q + edge[f][1] * q * q + edge[f][2] * q * q * q);
            assert_true(fabs(mie_extinction(mirror) - expected) < 1e-4);
            free(mirror);
        }
}

/* Diffraction by a strip as wide as the cylinder, f = a sinc^2(a sin d) with a = 2 x / (2 pi) diameters over the
 * wavelength, is the forward lobe of a large black cylinder: half of what it extinguishes. The edges add a part of the
 * order x^(-2/3) to the width of the strip. */
static void forward_lobe(void **unused)
{
    const double x = 2000, a = x / M_PI, edge = pow(x, -2.0 / 3);
    (void)unused;
    for (int f = 0; f < 2; f++) {
        struct mie_cylinder *c = cylinder(x, 1.5 + 0.1 * I, fields[f]);
        for (int k = 0; k < 10; k++) {
            const double sine = 0.08 * k / a, y = M_PI * a * sine, sinc = k > 0 ? sin(y) / y : 1;
            const double lobe = pow(cabs(mie_amplitude(c, asin(sine))), 2) / (M_PI * x);
            assert_true(fabs(lobe / a - sinc * sinc) < 4 * edge);
        }
        free(c);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(published_efficiencies), cmocka_unit_test(energy),
                                       cmocka_unit_test(extinction_of_large_cylinders), cmocka_unit_test(forward_lobe)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
