/* Fibers with tables of the fast renderer as a radiance source (fabric thesis, section 6.5): the camera ray is traced
 * to a fiber; light that is scattered once is evaluated there, light that is scattered more often comes from the
 * tables. */
#ifndef SELVEDGE_RENDERER_FAST_RADIANCE_H
#define SELVEDGE_RENDERER_FAST_RADIANCE_H

#include "renderer/transport/radiance_tracer.h"

extern const struct radiance_tracer fast_radiance;

#endif
