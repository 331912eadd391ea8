/* Light of a Gaussian lamp that a fiber scatters once, with the segment's visibility from the tables (fabric thesis,
 * section 6.5.2 and appendix C.2): no random numbers, no shadow ray.
 *
 * Below a sharpness of 100 visibility is a sum of spherical Gaussians: the product of each with the lamp is one
 * sharp Gaussian; above 200 it is an error function of the signed distance to the edge of the visible part; between
 * them, a mixture of both. */
#ifndef SELVEDGE_RENDERER_GAUSSIAN_LIGHT_H
#define SELVEDGE_RENDERER_GAUSSIAN_LIGHT_H

#include "renderer/fast/fast_tables.h"
#include "renderer/scattering/scattering.h"

/* A fiber where it is seen, in the frame of the flat cloth; unit vectors. */
struct gaussian_fiber {
    const struct scattering_model *model; /* one with a closed form: model->gaussian */
    const struct scattering_state *state;
    uint32_t i_segment;
    float tangent[3], wo[3];
};

/* Radiance towards wo under the light exp(sharpness (w . axis - 1)). */
void gaussian_light_scatter(const struct fast_tables *t, const struct gaussian_fiber *f, const float axis[3],
                            float sharpness, float rgb[3]);

#endif
