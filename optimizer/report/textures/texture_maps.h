/* One tile of cloth seen from above, from its fibers alone: heights, normals and directions, for textures.
 *
 * Pixels in rows from the top (+y) and from the left (-x); the middle of the picture is the corner (0, 0) of the tile,
 * as in a rendering of one tile, and the picture repeats. */
#ifndef SELVEDGE_OPTIMIZER_TEXTURE_MAPS_H
#define SELVEDGE_OPTIMIZER_TEXTURE_MAPS_H

#include "geometry/fibers/fiber_set.h"

#include <stdbool.h>

struct texture_maps {
    size_t width, height;
    double pixel_mm[2];
    size_t repeat[2];     /* of the tile along x and y, in the pictures that are written; 1 at first */
    float *height_mm;     /* of the highest fiber; 0 is the top of the cloth */
    float *fiber_normal;  /* x 3, of the highest fiber; (0, 0, 1) where there is none */
    float *normal;        /* x 3, of the smoothed heights */
    float *spread;        /* root mean square of the fibers' slopes relative to the smooth surface, over its mean */
    float *direction_rad; /* along the fibers, from +x, in [0, pi) */
    float *coherence;     /* 0: fibers run everywhere; 1: all along direction */
    float *cover;         /* part of the pixel where a fiber is seen */
    bool cut_out;         /* cover is the opacity of a surface, which is fitted with it; false at first */
    float *share;         /* x 3, brightness of reflected light over its mean (texture_tile.h); NULL: not rendered */
};

/* size: pixels along x and y. Pixels that are wide beside a fiber are means over finer ones. STATUS_NO_MEMORY. The
 * caller releases the maps, also on failure. */
status texture_maps_make(const struct fiber_set *f, const size_t size[2], struct texture_maps *m, struct error *err);
/* Mean of cover. */
double texture_maps_cover(const struct texture_maps *m);
/* Part of a pixel that the surface covers, at least a tenth; 1 without cut_out. */
double texture_maps_opacity(const struct texture_maps *m, size_t i);
/* Multiplies the slopes of the normals by a factor. */
void texture_maps_scale_normals(struct texture_maps *m, double factor);
/* Mean radius of the fibers. */
double texture_maps_radius_mm(const struct fiber_set *f);
/* Smooths an array of n_channel values a pixel over the edges of the tile, by nearly a Gaussian of standard deviation
 * sd_mm. room holds as many values. */
void texture_maps_smooth(const struct texture_maps *m, float *value, size_t n_channel, double sd_mm, float *room);
void texture_maps_release(struct texture_maps *m);

#endif
