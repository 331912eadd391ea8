#include "geometry/fibers/shape/fiber_roughen.h"
#include "base/rng.h"

#include <math.h>

enum { WAVES = 8, STEPS = 600 };
static const double cut_off = 3.0; /* of k l */

/* Finds wave numbers k l that divide the variance of the direction into equal parts: the middle of each part. */
static void choose_waves(double wave[WAVES])
{
    double sum = 0.0, total = 0.0;
    const double step = cut_off / STEPS;
    int n = 0;
    for (int i = 0; i < STEPS; i++) {
        double t = (i + 0.5) * step;
        total += t * t / (1.0 + t * t * t * t);
    }
    for (int i = 0; i < STEPS && n < WAVES; i++) {
        double t = (i + 0.5) * step;
        sum += t * t / (1.0 + t * t * t * t);
        if (sum >= (n + 0.5) / WAVES * total) wave[n++] = t;
    }
}

static void roughen_fiber(struct fiber_set *f, size_t i, const double wave[WAVES], const struct fiber_roughness *r)
{
    const struct rng_key key = {.seed = 0x726f756768u};
    const double each = r->direction_sd_rad * sqrt(2.0 / WAVES);
    double phase[3][WAVES], along_m = 0.0, before[3] = {0.0, 0.0, 0.0};
    struct rng random;
    rng_start(&random, &key, (uint32_t)i, 0);
    for (int a = 0; a < 3; a++)
        for (int k = 0; k < WAVES; k++) phase[a][k] = 2.0 * M_PI * rng_double(&random);
    for (size_t v = f->first_vertex[i]; v < f->first_vertex[i + 1]; v++) {
        float *p = f->position_m + 3 * v;
        double step2 = 0.0;
        for (int a = 0; a < 3; a++) {
            if (v > f->first_vertex[i]) step2 += ((double)p[a] - before[a]) * ((double)p[a] - before[a]);
            before[a] = (double)p[a];
        }
        along_m += sqrt(step2);
        for (int a = 0; a < 3; a++) {
            double moved_m = 0.0;
            for (int k = 0; k < WAVES; k++)
                moved_m += each * r->length_m / wave[k] * sin(wave[k] * along_m / r->length_m + phase[a][k]);
            p[a] = (float)((double)p[a] + moved_m);
        }
    }
}

void fiber_roughen(struct fiber_set *f, const struct fiber_roughness *r)
{
    double wave[WAVES];
    if (!(r->direction_sd_rad > 0.0)) return;
    choose_waves(wave);
    for (size_t i = 0; i < f->n_fiber; i++) roughen_fiber(f, i, wave, r);
}
