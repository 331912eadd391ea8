/* Fibers by dual scattering as a radiance source: the camera ray is traced to a fiber, a ray from there to the light
 * counts the fibers in front, and closed forms stand for all further scattering. No path is traced. */
#ifndef SELVEDGE_RENDERER_DUAL_RADIANCE_H
#define SELVEDGE_RENDERER_DUAL_RADIANCE_H

#include "renderer/transport/radiance_tracer.h"

extern const struct radiance_tracer dual_radiance;

#endif
