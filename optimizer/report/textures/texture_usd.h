/* The texture set as a USD stage beside its pictures, cloth.usda: a flat piece of the size of the textures. Renderers
 * that read MaterialX (outputs:mtlx:surface) find the OpenPBR surface of cloth.mtlx without transmitted light, others a
 * UsdPreviewSurface: a rough surface that reflects as much of even light as the cloth. */
#ifndef SELVEDGE_OPTIMIZER_TEXTURE_USD_H
#define SELVEDGE_OPTIMIZER_TEXTURE_USD_H

#include "optimizer/report/export/export_scene.h"
#include "optimizer/report/textures/texture_surface.h"

/* Errors of export_text_close. */
status texture_usd_write(const struct export_scene *e, const struct texture_surface *t, struct error *err);

#endif
