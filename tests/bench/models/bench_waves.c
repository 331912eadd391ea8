/* The solver of waves, and what its models cost to prepare. Prints one JSON object on each line.
 *
 *   waves.oblique_error
 *       Largest difference of an amplitude from the exact circular cylinder (mie_oblique.h), over the largest one, for
 *       circumferences of 0.5 to 60 wavelengths, 0 to 87 degrees from the plane across, all four pairs of fields,
 *       and outlines with and without a mirror.
 *   waves.oblique_published_error
 *       Largest difference of a cross-section of that cylinder from its published value.
 *   waves.prepare_ms
 *       Processor time in which wave_silk.v2 makes its tables for a set of parameters, mean of twenty.
 */
#include "base/angle.h"
#include "renderer/scattering/models/wave/solver/oblique_solver.h"
#include "renderer/scattering/scattering.h"
#include "tests/support/wave/circle_amplitudes.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { N_PREPARE = 20 };

static void stop(const char *what)
{
    fprintf(stderr, "bench_waves: %s\n", what);
    exit(1);
}

static double oblique_error(double x, double complex m, double theta_rad, double turn)
{
    static struct mie_oblique mie;
    const double angle = 0.7;
    struct wave_outline circle;
    struct oblique_solver *s = NULL;
    struct error err = {0};
    wave_outline_ellipse(&circle, 1, 1);
    circle.forward[1] *= cexp(I * turn);
    const struct oblique_problem p = {&circle, x, m, theta_rad, wave_solver_nodes(&circle, x, creal(m), 4)};
    if (oblique_solver_new(&p, &s, &err) != STATUS_OK || oblique_solver_solve(s, &angle, 1, &err) != STATUS_OK)
        stop(err.text);
    if (mie_oblique_init(&mie, x, m, theta_rad) != 0) stop("the circle is too large");
    const double error = circle_amplitude_error(s, &mie, angle);
    oblique_solver_free(s);
    return error;
}

static double prepare_ms(void)
{
    const struct scattering_model *m = scattering_find("wave_silk.v2");
    double param[SCATTERING_MAX_PARAM];
    for (size_t p = 0; p < m->n_param; p++) param[p] = m->param[p].start;
    const clock_t start = clock();
    for (int i = 0; i < N_PREPARE; i++) {
        struct scattering_state *s = NULL;
        struct error err = {0};
        if (m->prepare(param, &s, &err) != STATUS_OK) stop(err.text);
        m->release(s);
    }
    return 1e3 * (double)(clock() - start) / CLOCKS_PER_SEC / N_PREPARE;
}

static void print(const char *name, double value, const char *unit)
{
    printf("{\"name\":\"waves.%s\",\"value\":%.3g,\"unit\":\"%s\",\"better\":\"lower\"}\n", name, value, unit);
}

int main(void)
{
    static const double size[] = {0.5, 5.213, 20, 60}, theta_deg[] = {0, 40, -60, 70, 80, 87};
    static const double complex index[] = {1.5, 1.55, 1.55 + 0.02 * I, 1.6};
    double worst = 0;
    for (size_t k = 0; k < sizeof size / sizeof *size; k++)
        for (size_t t = 0; t < sizeof theta_deg / sizeof *theta_deg; t++)
            for (int turned = 0; turned < 2; turned++) /* the large one with its mirror only: a minute less */
                if (turned == 0 || size[k] < 50)
                    worst = fmax(worst, oblique_error(size[k], index[k], theta_deg[t] * RAD_PER_DEG, 0.3 * turned));
    print("oblique_error", worst, "1");
    print("oblique_published_error", mie_oblique_published_error(), "1");
    print("prepare_ms", prepare_ms(), "ms");
    return 0;
}
