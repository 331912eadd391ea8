/* Fibers with a scattering model as a radiance source. */
#ifndef SELVEDGE_RENDERER_SURFACE_RADIANCE_H
#define SELVEDGE_RENDERER_SURFACE_RADIANCE_H

#include "renderer/transport/radiance_tracer.h"

extern const struct radiance_tracer surface_radiance;

#endif
