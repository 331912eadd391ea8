/* The parts of struct wave_glint (wave_glint.h), which its sources share. */
#ifndef SELVEDGE_RENDERER_WAVE_GLINT_DATA_H
#define SELVEDGE_RENDERER_WAVE_GLINT_DATA_H

#include "renderer/glint/wave_glint.h"
#include "renderer/glint/wave_tree.h"

struct wave_glint {
    struct wave_tree tree;
    enum wave_model model;
    double coherence_um, window_um; /* window_um: sd of the weights of kernels */
    float area_um2;                 /* A_c */
    float narrow, wide;             /* standard deviations of a sample's slope: of most samples, and of the others */
    float weight_rgb[WAVE_N_COLOR][3], wavelength_um[WAVE_N_COLOR];
    double index[METAL_N][WAVE_N_COLOR][2]; /* n and k of each metal at these wavelengths */
};

/* Sets narrow and wide from the slopes of the field. */
void wave_glint_set_blur(struct wave_glint *g, const struct wave_height *h);

#endif
