/* Meshes for glTF files: vertices with normals, tangents and texture coordinates. Metres, y is up; a tile of the cloth
 * is a unit of texture coordinates, which run from the upper left corner of the tile's picture. */
#ifndef SELVEDGE_OPTIMIZER_GLTF_MESH_H
#define SELVEDGE_OPTIMIZER_GLTF_MESH_H

#include "base/progress.h"
#include "renderer/mesh/mesh.h"

struct gltf_mesh {
    size_t n_vertex, n_corner;                      /* fewer than 65,535 vertices */
    float *position_m, *normal, *tangent, *texture; /* x 3, 3, 4, 2; the fourth of a tangent is +1 (right-handed) */
    uint16_t *corner;
};

/* The draped piece of the twin (twin_file.c), with every second of its points along both edges. Errors of mesh_drape.
 */
status gltf_mesh_drape(const double tile_mm[2], const struct progress *progress, struct gltf_mesh *m,
                       struct error *err);
/* A ball of about 20 mm radius with a whole number of tiles around its equator, along which the weft runs. Near its
 * poles the cloth is squeezed along the weft. STATUS_NO_MEMORY. */
status gltf_mesh_ball(const double tile_mm[2], struct gltf_mesh *m, struct error *err);
void gltf_mesh_release(struct gltf_mesh *m);

#endif
