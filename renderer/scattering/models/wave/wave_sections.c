#include "renderer/scattering/models/wave/wave_table.h"

const double wave_length_m[3] = {610e-9, 550e-9, 465e-9};

/* A rounded triangle, 1.24 times as long as wide: silk without its gum (Xia et al. 2020 have an outline of 3.4 um; the
 * silk of the fabric thesis has 4.7 um). */
static void silk(struct wave_outline *o)
{
    wave_outline_lobed(o, 1, 3, 0.2);
    o->backward[1] = 0.16;
}

/* Polyester spun through a hole of three arms: a microfiber of 0.9 dtex. */
static void trilobal(struct wave_outline *o) { wave_outline_lobed(o, 1, 3, 0.4); }

/* Fine mature cotton, 14 um wide and 6 um high, bent; its lumen is closed. */
static void cotton(struct wave_outline *o) { wave_outline_bean(o, 7, 3, 0.35); }

const struct wave_section wave_sections[WAVE_N_SECTION] = {
    {"silk", 4.7e-6, 1.55, silk}, {"trilobal", 4.55e-6, 1.6, trilobal}, {"cotton", 4.58e-6, 1.55, cotton}};

/* Lagrange's polynomials of n nodes at x, factor by factor, and their slopes. */
static void lagrange(const double *node, int n, double x, double *weight, double *slope)
{
    for (int i = 0; i < n; i++) {
        weight[i] = 1;
        slope[i] = 0;
        for (int j = 0; j < n; j++) {
            if (j == i) continue;
            const double inv = 1 / (node[i] - node[j]), f = (x - node[j]) * inv;
            slope[i] = slope[i] * f + weight[i] * inv;
            weight[i] *= f;
        }
    }
}

void wave_table_weights(double root, double weight[WAVE_TABLE_N_CLEAR], double slope[WAVE_TABLE_N_CLEAR])
{
    double node[WAVE_TABLE_N_CLEAR];
    for (int i = 0; i < WAVE_TABLE_N_CLEAR; i++) node[i] = wave_table_root(i);
    lagrange(node, WAVE_TABLE_N_CLEAR, root, weight, slope);
}

void wave_table_tilt_weights(double cosine, double weight[WAVE_TABLE_N_TILT])
{
    double node[WAVE_TABLE_N_TILT], slope[WAVE_TABLE_N_TILT];
    for (int i = 0; i < WAVE_TABLE_N_TILT; i++) node[i] = wave_table_cosine(i);
    lagrange(node, WAVE_TABLE_N_TILT, fmin(fmax(cosine, node[0]), 1), weight, slope);
}
