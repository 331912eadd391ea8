/* A cloth ready for ray tracing: fibers as Embree round linear curves, or as elliptical cylinders, one tile, instanced
 * in a block; beyond the block rays are wrapped by whole tiles, so the cloth has no edge. Immutable after scene_new:
 * shared by threads. Millimetres inside.
 */
#ifndef SELVEDGE_RENDERER_SCENE_H
#define SELVEDGE_RENDERER_SCENE_H

#include "base/catalogue/film_material.h"
#include "base/status.h"
#include "geometry/fibers/fiber_set.h"
#include "renderer/mesh/mesh.h"

#include <stdbool.h>
#include <stdint.h>

struct scene;

struct scene_option {
    bool black_sheet; /* true: light that passes the cloth downwards is absorbed and none comes from below */
    bool sections;    /* true: fibers with measured flat sections have them as surfaces, as ellipses of the same area */
    /* The groups of fibers that are films; they have their sections as surfaces whatever `sections` says, and are no
     * groups of the scattering model. NULL: none. Other fibers are then circular cylinders. */
    const struct film_groups *films;
    bool no_avx512; /* Embree may use AVX2 at most: what a machine without AVX-512 does */
};

/* f must satisfy fiber_set_validate and may be released afterwards. STATUS_NO_MEMORY, STATUS_TOO_LARGE; STATUS_INVALID,
 * naming the fiber, for one that reaches too far beyond the tile and for a radius below 1/500,000 of the tile (single
 * precision). Segments longer than 200 radii are cut: segments of the scene may be more than those of f. */
status scene_new(const struct fiber_set *f, const struct scene_option *o, struct scene **scene, struct error *err);
/* The cloth of a flat scene laid on a mesh, its upper side on the mesh's and the texture coordinates of the mesh being
 * places in the cloth (a shell map: bent/shell.h). Nothing of the cloth is copied: `flat` must outlive it. The mesh's
 * origin is the orbit centre. black_sheet: one lies under all of the bent cloth, whatever lies under `flat`.
 * STATUS_INVALID, naming a triangle, where the mesh bends more tightly than the cloth is thick; for a scene that is
 * bent already; STATUS_NO_MEMORY. The mesh must have passed mesh_check and may be released afterwards. */
status scene_bend(const struct scene *flat, const struct mesh *mesh, bool black_sheet, struct scene **bent,
                  struct error *err);
/* The same flat cloth without its black sheet. Nothing is copied: `flat` must outlive it. STATUS_INVALID for a scene
 * that is bent, STATUS_NO_MEMORY. */
status scene_lift(const struct scene *flat, struct scene **lifted, struct error *err);
/* Whether a point (orbit center at the origin) lies in the cloth, between its upper and its lower side. */
bool scene_encloses(const struct scene *scene, const double p_mm[3]);
/* z of the lowest point of the cloth, its thickness included (orbit center at the origin). */
double scene_lowest_mm(const struct scene *scene);
/* Whether distant parts of a bent cloth run through each other; at_mm: one of the places. False for a flat one. */
bool scene_crosses_itself(const struct scene *scene, double at_mm[3]);
void scene_free(struct scene *scene);
size_t scene_memory_bytes(const struct scene *scene);
size_t scene_n_segment(const struct scene *scene);
/* Edges of the tile that repeats, along x and y. */
void scene_tile_mm(const struct scene *scene, double tile_mm[2]);
/* fiber_set_n_group of its fibers, films left out; at least 1. */
size_t scene_n_group(const struct scene *scene);

#endif
