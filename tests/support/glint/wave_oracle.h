/* Diffraction of a height field by its definition, as the reference of renderer/glint/wave_glint.h: the whole patch,
 * sampled finely, through a Fourier transform, or summed for one direction. Shares no code with it.
 *
 * Heights between texels follow from the Fourier series of the tile (zeros beyond its highest waves). */
#ifndef SELVEDGE_TESTS_WAVE_ORACLE_H
#define SELVEDGE_TESTS_WAVE_ORACLE_H

#include "renderer/glint/wave_height.h"

#include <complex.h>

struct wave_oracle {
    size_t n; /* samples along a side, a power of two */
    double step_um;
    double *height_um; /* rows of n, sample (0, 0) is at the middle of the texel (0, 0) */
};

/* factor: samples for each texel, a power of two. Ends the program without memory. */
void wave_oracle_init(struct wave_oracle *o, const struct wave_height *h, size_t factor);
void wave_oracle_release(struct wave_oracle *o);

/* The window exp(-r^2 / (2 sd^2)) to r = 3 sd about a place on the surface, which is in the tile. */
struct wave_oracle_window {
    double center_um[2], sd_um;
};

/* |integral of w exp(-i 2 pi (xi_3 H / lambda + v . s)) ds|^2 for the frequencies v = (i, j) / side, where i and j run
 * from -n / 2 to n / 2 - 1 modulo n. power: n n values. */
void wave_oracle_lobe(const struct wave_oracle *o, const struct wave_oracle_window *w, double xi_3,
                      double wavelength_um, double *power);
/* The same for one direction psi, with xi_2 = 1 - (psi . H') per_psi_n. */
double wave_oracle_sum(const struct wave_oracle *o, const struct wave_oracle_window *w, double xi_3,
                       const double psi[2], double per_psi_n, double wavelength_um);

/* In place, without a factor: sign -1 forward, 1 back. n: a power of two. */
void wave_oracle_fourier(double complex *x, size_t n, int sign);

#endif
