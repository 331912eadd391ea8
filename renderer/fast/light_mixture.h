/* The environment of a configuration as a mixture of spherical Gaussians, for light that is scattered more than once.
 */
#ifndef SELVEDGE_RENDERER_LIGHT_MIXTURE_H
#define SELVEDGE_RENDERER_LIGHT_MIXTURE_H

#include "renderer/fast/sphere_harmonics.h"
#include "renderer/transport/lights.h"

enum { MIXTURE_MAX = 96 };

struct light_mixture {
    size_t n; /* 0: no environment */
    float direction[MIXTURE_MAX][3];
    float rgb[MIXTURE_MAX][3];         /* radiance times solid angle */
    float cumulative[MIXTURE_MAX];     /* of brightness, the last one 1 */
    float zonal[SPHERE_MAX_ORDER + 1]; /* by which harmonics of order l of the axis are multiplied */
};

/* Axes lie at the centroids of the light around Fibonacci points. In the frame of the turned cloth. */
void light_mixture_init(struct light_mixture *m, const struct lights *l);
/* One of them in proportion to its brightness, u in [0, 1). */
size_t light_mixture_pick(const struct light_mixture *m, float u);
/* The same with its light over its chance: a surface that faces the direction has the irradiance pi times scale. */
void light_mixture_sample(const struct light_mixture *m, float u, float direction[3], float scale[3]);

#endif
