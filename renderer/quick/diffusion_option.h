/* How a radiance source renders by diffusion. */
#ifndef SELVEDGE_RENDERER_DIFFUSION_OPTION_H
#define SELVEDGE_RENDERER_DIFFUSION_OPTION_H

#include "renderer/quick/diffusion_tables.h"

struct diffusion_option {
    const struct diffusion_tables *tables; /* they say how many hits of a path are traced */
};

#endif
