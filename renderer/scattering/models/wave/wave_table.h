/* Tables of azimuthal scattering by waves for the sections that wave_silk.v2, wave_trilobal.v2 and wave_cotton.v2
 * have, made by wave-tables, a program of the tree (`make wave-tables`), and checked in as source: 29 kB each.
 *
 * N(ph; C, theta) is the density of the azimuth between incident and exitant light, 0 where it goes back, for light at
 * the angle theta from the plane across a fiber whose material lets C through over the diameter of a circle of the
 * section's area, across: the mean over both polarisations, over the orientations of the section (wave_mean.h), and
 * over sizes and wavelengths, whose ratio has a normally distributed logarithm of the deviation WAVE_TABLE_SPREAD about
 * the channel's. It stands as Fourier coefficients
 *
 *     wave[t][c][i][k] / WAVE_TABLE_ONE = integral of N cos(k ph) dph
 *     N = (wave[0] + 2 sum over k of wave[k] cos(k ph)) / (2 pi)
 *
 * for WAVE_TABLE_N_TILT values of cos(theta) and WAVE_TABLE_N_CLEAR values of C, between which N is a polynomial in
 * cos(theta) and in the cube root of C. Nearer to the axis than the least cosine, N stays the same. wave[0] is the
 * share of the light that is not absorbed.
 */
#ifndef SELVEDGE_RENDERER_WAVE_TABLE_H
#define SELVEDGE_RENDERER_WAVE_TABLE_H

#include "renderer/scattering/models/wave/solver/wave_outline.h"

#include <math.h>
#include <stdint.h>

enum { WAVE_TABLE_N_TILT = 10, WAVE_TABLE_N_CLEAR = 6, WAVE_TABLE_N_WAVE = 80, WAVE_TABLE_ONE = 10000 };

#define WAVE_TABLE_LEAST_CLEAR 1e-3
#define WAVE_TABLE_LEAST_COSINE 0.08 /* 85.4 degrees */
/* Sizes of fibers vary by 10 %, and a channel takes in wavelengths of +-4 %: sqrt(0.10^2 + 0.04^2). */
#define WAVE_TABLE_SPREAD 0.1077

struct wave_table {
    int16_t wave[WAVE_TABLE_N_TILT][3][WAVE_TABLE_N_CLEAR][WAVE_TABLE_N_WAVE + 1];
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

/* The i-th of n extremes of Chebyshev's polynomial over the range from `least` to 1. */
static inline double wave_table_node(int i, int n, double least)
{
    return least + (1 - least) * 0.5 * (1 - cos(M_PI * i / (n - 1)));
}

/* The i-th cube root of C, and the i-th cosine of theta. */
static inline double wave_table_root(int i)
{
    return wave_table_node(i, WAVE_TABLE_N_CLEAR, cbrt(WAVE_TABLE_LEAST_CLEAR));
}

static inline double wave_table_cosine(int i) { return wave_table_node(i, WAVE_TABLE_N_TILT, WAVE_TABLE_LEAST_COSINE); }

/* Weights of the values of C for a cube root within their range, and their derivatives by it. */
void wave_table_weights(double root, double weight[WAVE_TABLE_N_CLEAR], double slope[WAVE_TABLE_N_CLEAR]);
/* Weights of the values of theta for cos(theta) in [0, 1]. */
void wave_table_tilt_weights(double cosine, double weight[WAVE_TABLE_N_TILT]);

#endif
