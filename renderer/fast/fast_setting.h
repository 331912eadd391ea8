/* One configuration of a cloth that is rendered by tables (fast_shade.h). */
#ifndef SELVEDGE_RENDERER_FAST_SETTING_H
#define SELVEDGE_RENDERER_FAST_SETTING_H

#include "renderer/fast/fast_tables.h"
#include "renderer/fast/light_mixture.h"
#include "renderer/transport/surface/path_tracer.h"

struct fast_setting {
    struct path_setting path; /* first; scene, model, lights; its paths are those that correct */
    const struct fast_option *option;
    struct light_mixture mixture;
    /* Of a flat cloth: radiance that arrives at each row of transfer, n_transfer x 3 x n_harmonic, under the lamp as it
     * is seen from the orbit centre and the environment. NULL: it is computed hit by hit. */
    float *arriving;
};

#endif
