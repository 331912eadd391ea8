/* Two glTF materials of a fitted surface with their textures: the first shows the light that the cloth reflects, in
 * every viewer. The second lets light through, too; viewers that do not know KHR_materials_diffuse_transmission show it
 * too bright, so that it is a variant (KHR_materials_variants) and not what a file shows first. */
#ifndef SELVEDGE_OPTIMIZER_GLTF_MATERIAL_H
#define SELVEDGE_OPTIMIZER_GLTF_MATERIAL_H

#include "optimizer/report/textures/glb_file.h"
#include "optimizer/report/textures/gltf_surface.h"
#include "optimizer/report/textures/texture_tile.h"

/* Adds the textures to the file. *materials: the array of the document. STATUS_NO_MEMORY. */
status gltf_material_add(const struct gltf_surface *g, const struct texture_tile *tile, struct glb_file *file,
                         json_t **materials, struct error *err);
/* Names of the variants and of extensions of the materials, for the document. */
json_t *gltf_material_variants(void);
json_t *gltf_material_extensions(void);
/* Which variant has which material, for a primitive. */
json_t *gltf_material_mappings(void);

#endif
