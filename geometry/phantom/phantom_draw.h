/* Draws the fibers of a phantom into slices (used only in this folder). */
#ifndef SELVEDGE_GEOMETRY_PHANTOM_DRAW_H
#define SELVEDGE_GEOMETRY_PHANTOM_DRAW_H

#include "geometry/phantom/phantom_strand.h"
#include "geometry/volume/volume.h"

/* A slab of slices, first .. first + n_slice. The caller owns the arrays, each of n_slice slices. */
struct phantom_slab {
    const struct fiber_set *f;
    const struct phantom_section_law *section; /* NULL: each vertex has its own section, f->shape */
    double voxel_size_m;
    size_t n[3]; /* voxels of the volume; periodic in x and y */
    size_t first, n_slice;
    float *drawn;    /* sums of the shares of all fibers, at most 1 */
    uint32_t *owner; /* number + 1 of the fiber that last touched a voxel */
    float *share;    /* share of the owner in the voxel */
    float *apart;    /* distance of its axis, in voxels; NULL if all sections are full discs */
};

/* Whether all sections are full discs, of any radius. */
bool phantom_slab_is_disc(const struct phantom_slab *s);
/* Draws slices from .. to (counted in the slab), which are then complete. */
void phantom_slab_draw(struct phantom_slab *s, size_t from, size_t to);

#endif
