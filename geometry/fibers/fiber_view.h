/* A picture of fibers from above, and the share of the tile that they cover. */
#ifndef SELVEDGE_GEOMETRY_FIBER_VIEW_H
#define SELVEDGE_GEOMETRY_FIBER_VIEW_H

#include "geometry/fibers/fiber_set.h"

/* Returns the share of the tile's area under a fiber, along z, at the given pixel size. Sections are round,
 * except of films, more than four times as wide as high. grey (optional) gets one byte per pixel, 255 for the highest
 * fiber: nx x ny, row 0 at y = 0, freed by the caller. STATUS_INVALID, STATUS_NO_MEMORY. */
status fiber_top_view(const struct fiber_set *f, double pixel_size_m, size_t size[2], uint8_t **grey, double *cover,
                      struct error *err);

#endif
