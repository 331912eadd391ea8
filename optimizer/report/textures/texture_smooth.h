/* A rendering of a tile without its noise, for textures: yarns are kept, because light is smoothed over a few fiber
 * radii only, as the normals of the maps are; and fibers are kept as far as their shape explains their brightness.
 * With L smoothed light, and features f of the maps (height, normal and cover of the fibers), the result is
 *
 *   L(x) + sum_k a_k (f_k(x) - smoothed f_k(x)),
 *
 * in which a_k are fitted to all pixels of the tile, so that they have hardly any noise. All of it repeats with the
 * tile. */
#ifndef SELVEDGE_OPTIMIZER_TEXTURE_SMOOTH_H
#define SELVEDGE_OPTIMIZER_TEXTURE_SMOOTH_H

#include "optimizer/report/textures/texture_maps.h"
#include "renderer/image/image.h"

/* half: two renderings from independent samples, rgb first. out: initialised with 3 channels. sd_mm: standard deviation
 * of the smoothing; 0: out is the mean of both. *noise: of a pixel of out, root mean square over the root mean square
 * of out, from the difference of what both halves become. STATUS_NO_MEMORY. */
status texture_smooth(const struct texture_maps *m, const struct image half[2], double sd_mm, struct image *out,
                      double *noise, struct error *err);

#endif
