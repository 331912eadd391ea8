/* How a radiance source uses the tables of the fast renderer. */
#ifndef SELVEDGE_RENDERER_FAST_OPTION_H
#define SELVEDGE_RENDERER_FAST_OPTION_H

#include "renderer/fast/fast_tables.h"

enum fast_visibility {
    FAST_TRACED = 0, /* light that is scattered once is traced: a shadow ray through the fibers */
    FAST_TABLES      /* it is seen or not as the tables say, and shaded by the shell of a bent cloth */
};

struct fast_option {
    const struct fast_tables *tables;
    enum fast_visibility visibility;
    /* Hits that are traced, with FAST_TRACED; at the last of them the table has the light that was scattered before. 1
     * is the published method; more take longer, and have sharper light in the cloth. 0: 1. */
    uint32_t n_traced;
    /* Take light that is scattered more than n_traced times from tables->deep, at the first hit of a path, instead of
     * from the cells at the last. With FAST_TRACED and n_traced as in the table. */
    bool deep;
};

#endif
