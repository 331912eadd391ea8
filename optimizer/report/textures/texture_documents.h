/* The texture set as a MaterialX document (OpenPBR surface) and as a U3M 1.1 material, beside the pictures that
 * export_textures.c writes. */
#ifndef SELVEDGE_OPTIMIZER_TEXTURE_DOCUMENTS_H
#define SELVEDGE_OPTIMIZER_TEXTURE_DOCUMENTS_H

#include "optimizer/report/export/export_scene.h"
#include "optimizer/report/textures/texture_principled.h"

/* cloth.mtlx: MaterialX 1.39, node open_pbr_surface. Light that the cloth lets through is its thin-walled
 * subsurface. */
status texture_materialx_write(const struct export_scene *e, const struct texture_surface *t, struct error *err);
/* cloth.u3m: github.com/vizoogmbh/u3m, version 1.1 (u3m_schema.json). */
status texture_u3m_write(const struct export_scene *e, const struct texture_principled *p, struct error *err);

/* Millimetres between the lowest and the highest value of height.png. */
double texture_height_range_mm(const struct export_scene *e);
/* Pixels of preview.png along x and y: a part of the textures, at their size. */
void texture_preview_size(const struct texture_maps *m, size_t size[2]);

#endif
