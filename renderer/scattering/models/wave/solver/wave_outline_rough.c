/* Outlines with a rough surface (wave_outline.h). */
#include "renderer/scattering/models/wave/solver/wave_outline.h"

#include "renderer/scattering/models/wave/solver/complex_parts.h"

#include <math.h>

enum {
    N = 1024,
    N_ROUGH = 48 /* waves of the height: the products with waves of a smooth outline stay in the series */
};

/* Amplitudes of the waves of the height, by the length along an outline of so much. */
static void draw_waves(double length_whole, double height_sd, double length, struct rng *rng, double complex *wave)
{
    double power[N_ROUGH + 1], sum = 0;
    for (int k = 1; k <= N_ROUGH; k++) { /* the spectrum of a Gaussian correlation */
        const double x = M_PI * k * length / length_whole;
        power[k] = exp(-x * x);
        sum += power[k];
    }
    for (int k = 1; k <= N_ROUGH; k++) {
        double normal[2];
        rng_normal_pair(rng, normal);
        wave[k] = height_sd * sqrt(power[k] / sum) * complex_of(normal[0], normal[1]);
    }
}

void wave_outline_roughen(struct wave_outline *o, double height_sd, double length, struct rng *rng)
{
    double complex wave[N_ROUGH + 1], at[N];
    const double whole = wave_outline_length(o);
    double s = 0;
    draw_waves(whole, height_sd, length, rng, wave);
    for (int i = 0; i < N; i++) {
        double complex d;
        const double complex z = wave_outline_at(o, 2 * M_PI * i / N, &d, NULL);
        double height = 0;
        for (int k = 1; k <= N_ROUGH; k++) height += creal(wave[k] * cexp(I * (2 * M_PI * k * s / whole)));
        at[i] = z - I * d / cabs(d) * height; /* the outline runs counter-clockwise */
        s += cabs(d) * 2 * M_PI / N;
    }
    o->n_wave = WAVE_OUTLINE_MAX;
    for (int k = 0; k <= WAVE_OUTLINE_MAX; k++) {
        o->forward[k] = o->backward[k] = 0;
        for (int i = 0; i < N && k > 0; i++) {
            const double complex turn = cexp(I * (2 * M_PI * ((double)k * i / N)));
            o->forward[k] += at[i] * conj(turn) / N;
            o->backward[k] += at[i] * turn / N;
        }
    }
}
