/* One tile of the fitted cloth for a texture set: its maps, and its renderings under even light of radiance 1. */
#ifndef SELVEDGE_OPTIMIZER_TEXTURE_TILE_H
#define SELVEDGE_OPTIMIZER_TEXTURE_TILE_H

#include "optimizer/report/export/export_scene.h"
#include "optimizer/report/textures/texture_fit.h"
#include "renderer/image/image.h"

#define TEXTURE_NOISE 0.02

/* Noise of a pixel, root mean square over the root mean square of the picture; and by how much the picture was smoothed
 * to bring it below TEXTURE_NOISE (texture_smooth.h). */
struct texture_noise {
    double rel_se, smooth_mm;
};

#define TEXTURE_TILE_SHARE 0.8 /* of an export's progress, before its fit and its files */

struct texture_tile {
    struct texture_maps maps;
    struct texture_means means;
    struct image reflected, transmitted; /* 3 channels, of light from above and from below */
    struct texture_noise noise[2];       /* of each */
};

/* Pixels of a tile, and how often it is repeated along x and y. */
struct texture_size {
    size_t tile_px[2], repeat[2];
};

/* The whole number of repeats whose edge comes nearest to edge_mm, with at most most_px pixels on the longer side, at
 * least 2 and at most 1,024 of them on a tile. */
struct texture_size texture_size_of(const double tile_mm[2], double edge_mm, size_t most_px);
/* As the job document asks for. */
struct texture_size texture_size_wanted(const struct export_scene *e);

/* Makes the maps with tile_px pixels along x and y, and renders the tile from above. Errors of render_run;
 * STATUS_NO_MEMORY. Release in any case. */
status texture_tile_make(const struct export_scene *e, const size_t tile_px[2], struct texture_tile *t,
                         struct error *err);
void texture_tile_release(struct texture_tile *t);
/* Paths of a photograph that take as long as both renderings, the fit of the textures and their files. */
double texture_tile_paths(const struct job_results *results, size_t n_row, double n_fit_path);

#endif
