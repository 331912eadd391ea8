/* A cloth with a pile as a radiance source for previews: the first hits of each path are traced, and the light that is
 * scattered more often comes from averages of the cloth and the dipole of its pile.
 */
#ifndef SELVEDGE_RENDERER_DIFFUSION_RADIANCE_H
#define SELVEDGE_RENDERER_DIFFUSION_RADIANCE_H

#include "renderer/transport/radiance_tracer.h"

extern const struct radiance_tracer diffusion_radiance;

#endif
