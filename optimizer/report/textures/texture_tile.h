/* One tile of the fitted cloth for a texture set: its maps, and its renderings under even light of radiance 1. */
#ifndef SELVEDGE_OPTIMIZER_TEXTURE_TILE_H
#define SELVEDGE_OPTIMIZER_TEXTURE_TILE_H

#include "optimizer/report/export/export_scene.h"
#include "optimizer/report/textures/texture_fit.h"
#include "renderer/image/image.h"

#define TEXTURE_TILE_SHARE 0.8 /* of an export's progress, before its fit and its files */

struct texture_tile {
    struct texture_maps maps;
    struct texture_means means;
    struct image reflected, transmitted; /* 3 channels */
    double noise;                        /* relative standard error of a pixel of `reflected`, root mean square */
};

/* Renders the tile from above over a black sheet (the reflected share) and without one (the difference is the
 * transmitted share). Errors of render_run; STATUS_NO_MEMORY. Release in any case. */
status texture_tile_make(const struct export_scene *e, struct texture_tile *t, struct error *err);
void texture_tile_release(struct texture_tile *t);
/* Paths of a photograph that take as long as both renderings, the fit of the textures and their files. */
double texture_tile_paths(const struct job_results *results, size_t n_row, double n_fit_path);

#endif
