/* A scan in two bytes a voxel, for a viewer of its slices: the density, and the direction of the fiber. */
#ifndef SELVEDGE_GEOMETRY_SLICE_CODES_H
#define SELVEDGE_GEOMETRY_SLICE_CODES_H

#include "base/thread_pool.h"
#include "geometry/volume/volume.h"

/* density: 0 .. SLICE_DENSITY_STEPS stand for densities of 0 .. 1. direction: 0 where no fiber is; else 1 + the place
 * of the squares of the direction's components, rounded to multiples of 1 / SLICE_DIRECTION_STEPS whose sum is 1, in
 * the order x^2 = 0 .. 1, and y^2 = 0 .. 1 - x^2 within it: 253 codes. Signs are lost. Colours that mix one colour for
 * each axis by these squares need no more. */
enum { SLICE_DENSITY_STEPS = 31, SLICE_DIRECTION_STEPS = 21 };

struct slice_codes {
    size_t n[3];
    double voxel_size_m[3];
    size_t factor; /* edge of a voxel here, in voxels of the scan */
    uint8_t *density, *direction;
    struct scratch_space *space; /* not owned */
};

/* d: any length except 0. */
uint8_t slice_direction_code(const float d[3]);
/* Codes the densities of v and the directions of d, which has the same grid. A scan of more than most_voxel voxels is
 * shrunk by a power of two along each axis until it has no more: a voxel then gets the mean density, and the direction
 * of its densest fiber voxel. STATUS_INVALID, STATUS_NO_MEMORY, STATUS_DISK_FULL, STATUS_CANCELLED; the caller releases
 * the codes also then. */
status slice_codes_make(const struct volume *v, const struct direction_volume *d, size_t most_voxel,
                        struct thread_pool *pool, const struct progress *progress, struct slice_codes *codes,
                        struct error *err);
void slice_codes_release(struct slice_codes *codes);
/* Halves a slice of width x height codes in both directions, in the same way. to: as from, of the halves rounded up. */
void slice_codes_halve(const uint8_t *density, const uint8_t *direction, size_t width, size_t height,
                       uint8_t *to_density, uint8_t *to_direction);

#endif
