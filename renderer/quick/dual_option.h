/* How a radiance source renders by dual scattering. */
#ifndef SELVEDGE_RENDERER_DUAL_OPTION_H
#define SELVEDGE_RENDERER_DUAL_OPTION_H

#include "renderer/quick/dual_tables.h"

struct dual_option {
    const struct dual_tables *tables;
    /* Shares of light that is scattered by fibers in front and that comes back from fibers behind: 0.6 to 0.8 for hair
     * as published, 1 for cloth (fabric thesis, section 6.6), whose fibers lie closer. */
    float density_forward, density_backward;
};

#endif
