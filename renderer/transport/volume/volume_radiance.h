/* A density volume with a phase function as a radiance source. Its last parameter is the density multiplier d. */
#ifndef SELVEDGE_RENDERER_VOLUME_RADIANCE_H
#define SELVEDGE_RENDERER_VOLUME_RADIANCE_H

#include "renderer/transport/radiance_tracer.h"

extern const struct radiance_tracer volume_radiance;

#endif
