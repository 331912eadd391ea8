/* Samples of the Gaussian elements under a footprint: an element by its weight, then one of its normals (000, section
 * 3.9). The density of the samples is exactly the sum that glint_cells evaluates, but for its cut at GLINT_REACH. */
#ifndef SELVEDGE_RENDERER_GLINT_DRAW_H
#define SELVEDGE_RENDERER_GLINT_DRAW_H

#include "renderer/glint/glint_element.h"

/* Two independent standard normal deviates of two numbers in [0, 1), by Box and Muller. */
void glint_normal_pair(const float u[2], float out[2]);

void glint_draw(const struct glint_lattice *l, const struct glint_query *q, const float u[GLINT_N_NUMBER],
                float half[2]);

#endif
