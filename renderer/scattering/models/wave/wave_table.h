/* Tables of azimuthal scattering by waves for the sections that wave_silk.v1, wave_trilobal.v1 and wave_cotton.v1
 * have, made by wave-tables, a program of the tree (`make wave-tables`), and checked in as source: 7 kB each.
 *
 * N(ph; C) is the density of the azimuth between incident and exitant light, 0 where it goes back, for a fiber whose
 * material lets C through over the diameter of a circle of the section's area: the mean over both polarisations, over
 * the orientations of the section (wave_mean.h), and over sizes and wavelengths, whose ratio has a normally distributed
 * logarithm of the deviation WAVE_TABLE_SPREAD about the channel's. It stands as Fourier coefficients
 *
 *     wave[c][i][k] = integral of N cos(k ph) dph,   N = (wave[0] + 2 sum over k of wave[k] cos(k ph)) / (2 pi)
 *
 * at WAVE_TABLE_N_CLEAR values of C, between which N is a polynomial in the cube root of C. wave[0] is the share of
 * the light that is not absorbed.
 */
#ifndef SELVEDGE_RENDERER_WAVE_TABLE_H
#define SELVEDGE_RENDERER_WAVE_TABLE_H

#include "renderer/scattering/models/wave/solver/wave_outline.h"

#include <math.h>

enum { WAVE_TABLE_N_CLEAR = 6, WAVE_TABLE_N_WAVE = 96 };

#define WAVE_TABLE_LEAST_CLEAR 1e-4
/* Sizes of fibers vary by 10 %, and a channel takes in wavelengths of +-4 %: sqrt(0.10^2 + 0.04^2). */
#define WAVE_TABLE_SPREAD 0.1077

struct wave_table {
    double index; /* of refraction, in all channels */
    float wave[3][WAVE_TABLE_N_CLEAR][WAVE_TABLE_N_WAVE + 1];
};

extern const struct wave_table wave_silk_table, wave_trilobal_table, wave_cotton_table;

/* A section for which a table is made. */
struct wave_section {
    const char *name;
    double radius_m; /* of a circle of the same area */
    double index;
    void (*outline)(struct wave_outline *o); /* of any size */
};
enum { WAVE_N_SECTION = 3 };
extern const struct wave_section wave_sections[WAVE_N_SECTION];
/* Wavelengths of the channels. */
extern const double wave_length_m[3];

/* The i-th cube root of C: extremes of Chebyshev's polynomial over the range. */
static inline double wave_table_root(int i)
{
    const double least = cbrt(WAVE_TABLE_LEAST_CLEAR);
    return least + (1 - least) * 0.5 * (1 - cos(M_PI * i / (WAVE_TABLE_N_CLEAR - 1)));
}

/* Weights of the values of C for a cube root within their range, and their derivatives by it. */
void wave_table_weights(double root, double weight[WAVE_TABLE_N_CLEAR], double slope[WAVE_TABLE_N_CLEAR]);

#endif
