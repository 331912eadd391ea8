/* Makes the tables of speckle (speckle.h): simulates rough fibers (speckle_instances.h), and finds the weights of
 * bands whose correlation comes nearest to theirs.
 *
 * speckle-tables FILE
 *   FILE   where the tables of all sections are written
 * Prints for each section the weights, contrast and correlation of the simulated light, and the time.
 *
 * The correlation of the intensity of fully developed speckle is the square of the correlation of its field (Goodman
 * 2007). So v_b >= 0 minimise the squares of sqrt(C) - sum of v_b C_b (non-negative least squares), C_b the correlation
 * of the field of a band, and weight_b = sqrt(v_b / sum of v). The pattern grows about wi + wo = 0 with a power of the
 * wavelength with which the correlations between channels equal the correlations of the simulated light; it would be 1
 * for waves of a thin rough layer.
 */
#include "base/clock.h"
#include "renderer/scattering/models/wave/speckle_instances.h"
#include "renderer/scattering/speckle.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define CELL 3.0 /* of band 0, in wavelengths over the radius */

static void stop(const char *what)
{
    fprintf(stderr, "speckle-tables: %s\n", what);
    exit(1);
}

static double band_correlation(int band, int i)
{
    return speckle_band_correlation(i * SPECKLE_DISTANCE_STEP / CELL * (1 << band));
}

/* Non-negative least squares by coordinate descent, which converges for a positive definite matrix. */
static void fit(const double correlation[SPECKLE_N_DISTANCE], double v[SPECKLE_N_BAND])
{
    enum { N_SWEEP = 20000 };
    double a[SPECKLE_N_BAND][SPECKLE_N_BAND] = {{0}}, b[SPECKLE_N_BAND] = {0}, of_band[SPECKLE_N_BAND];
    for (int i = 0; i < SPECKLE_N_DISTANCE; i++) {
        for (int p = 0; p < SPECKLE_N_BAND; p++) of_band[p] = band_correlation(p, i);
        for (int p = 0; p < SPECKLE_N_BAND; p++) {
            b[p] += of_band[p] * sqrt(fmax(0, correlation[i]));
            for (int q = 0; q < SPECKLE_N_BAND; q++) a[p][q] += of_band[p] * of_band[q];
        }
    }
    memset(v, 0, SPECKLE_N_BAND * sizeof *v);
    for (int sweep = 0; sweep < N_SWEEP; sweep++)
        for (int p = 0; p < SPECKLE_N_BAND; p++) {
            double rest = b[p];
            for (int q = 0; q < SPECKLE_N_BAND; q++) rest -= a[p][q] * v[q];
            v[p] = fmax(0, v[p] + rest / a[p][p]);
        }
}

static double cells(const struct wave_section *s, int channel, double power)
{
    return s->radius_m / wave_length_m[1] * pow(wave_length_m[1] / wave_length_m[channel], power) / CELL;
}

/* Correlation of f in red with green, or green with blue, over the light. */
static double between_channels(const struct wave_section *s, const struct speckle_statistics *t,
                               const float weight[SPECKLE_N_BAND], double power, int i)
{
    const double apart = cells(s, i + 1, power) - cells(s, i, power);
    double sum = 0;
    for (int k = 0; k < SPECKLE_N_LENGTH; k++)
        sum += t->by_length[k] * speckle_correlation(weight, 2 * (k + 0.5) / SPECKLE_N_LENGTH * apart);
    return sum;
}

/* The power between 0 and 1 of least squares. */
static double fit_power(const struct wave_section *s, const struct speckle_statistics *t,
                        const float weight[SPECKLE_N_BAND])
{
    enum { N_STEP = 50 };
    double best = 0, least = INFINITY;
    for (int k = 0; k <= N_STEP; k++) {
        const double power = (double)k / N_STEP;
        double squares = 0;
        for (int i = 0; i < 2; i++)
            squares += pow(between_channels(s, t, weight, power, i) - t->between_channels[i], 2);
        if (squares < least) {
            least = squares;
            best = power;
        }
    }
    return best;
}

static void write_table(FILE *f, const struct wave_section *s, const float weight[SPECKLE_N_BAND], double power)
{
    fprintf(f, "const struct speckle_table wave_%s_speckle = {\n{", s->name);
    for (int c = 0; c < 3; c++) fprintf(f, "%.6gF,", cells(s, c, power));
    fprintf(f, "}, {");
    for (int b = 0; b < SPECKLE_N_BAND; b++) fprintf(f, "%.6fF,", (double)weight[b]);
    fprintf(f, "}};\n");
}

static void report(const struct wave_section *s, const struct speckle_statistics *t, const float weight[SPECKLE_N_BAND],
                   double power, double seconds)
{
    printf("%s: weights", s->name);
    for (int b = 0; b < SPECKLE_N_BAND; b++) printf(" %.3f", (double)weight[b]);
    printf(", power of the wavelength %.2f; %.1f s\n", power, seconds);
    for (int z = 0; z < SPECKLE_N_ZONE; z++)
        printf("  %d to %d degrees from straight on: %.3f of the light, contrast^2 %.3f\n", z * 45, z * 45 + 45,
               t->zone_share[z], t->zone_contrast2[z]);
    printf("  correlation of red with green %.3f (of f %.3f), green with blue %.3f (%.3f)\n", t->between_channels[0],
           between_channels(s, t, weight, power, 0), t->between_channels[1], between_channels(s, t, weight, power, 1));
    printf("  of 2 degrees: at equal half vectors %.3f, turned %.3f\n", t->memory, t->turned);
    printf("  distance, correlation of the fibers and of f:\n");
    for (int i = 0; i < SPECKLE_N_DISTANCE; i++)
        printf("  %.1f %.3f %.3f\n", i * SPECKLE_DISTANCE_STEP, t->correlation[i],
               speckle_correlation(weight, i * SPECKLE_DISTANCE_STEP / CELL));
}

static void make(struct thread_pool *pool, const struct wave_section *section, FILE *f)
{
    struct speckle_statistics t;
    struct error err = {0};
    double v[SPECKLE_N_BAND], sum = 0, start = clock_monotonic_s();
    float weight[SPECKLE_N_BAND];
    if (speckle_instances(section, pool, &t, &err) != STATUS_OK) stop(err.text);
    fit(t.correlation, v);
    for (int b = 0; b < SPECKLE_N_BAND; b++) sum += v[b];
    for (int b = 0; b < SPECKLE_N_BAND; b++) weight[b] = (float)sqrt(v[b] / sum);
    const double power = fit_power(section, &t, weight);
    write_table(f, section, weight, power);
    report(section, &t, weight, power, clock_monotonic_s() - start);
}

int main(int argc, char **argv)
{
    struct thread_pool *pool = NULL;
    if (argc != 2) stop("usage: speckle-tables FILE");
    if (thread_pool_new(0, &pool, NULL) != STATUS_OK) stop("out of memory");
    FILE *f = fopen(argv[1], "w");
    if (f == NULL) stop("cannot write the file");
    fprintf(f, "/* Made by speckle-tables (`make speckle-tables`), not by hand; speckle.h defines them. */\n"
               "#include \"renderer/scattering/models/wave/speckle_tables.h\"\n\n/* clang-format off */\n");
    for (int i = 0; i < WAVE_N_SECTION; i++) make(pool, &wave_sections[i], f);
    fprintf(f, "/* clang-format on */\n");
    if (fclose(f) != 0) stop("cannot write the file");
    thread_pool_free(pool);
    return 0;
}
