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

void wave_table_weights(double root, double weight[WAVE_TABLE_N_CLEAR], double slope[WAVE_TABLE_N_CLEAR])
{
    for (int i = 0; i < WAVE_TABLE_N_CLEAR; i++) { /* Lagrange's polynomials, factor by factor */
        weight[i] = 1;
        slope[i] = 0;
        for (int j = 0; j < WAVE_TABLE_N_CLEAR; j++) {
            if (j == i) continue;
            const double inv = 1 / (wave_table_root(i) - wave_table_root(j)), f = (root - wave_table_root(j)) * inv;
            slope[i] = slope[i] * f + weight[i] * inv;
            weight[i] *= f;
        }
    }
}
