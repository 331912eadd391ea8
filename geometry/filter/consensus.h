/* Mean fiber directions of neighbourhoods: direction tensors averaged on a coarse grid and blurred over about a
 * fiber diameter. The fibers of a yarn run side by side, so where J does not distinguish two directions, the direction
 * of the neighbourhood is the right one. */
#ifndef SELVEDGE_GEOMETRY_CONSENSUS_H
#define SELVEDGE_GEOMETRY_CONSENSUS_H

#include "base/files/scratch_space.h"
#include "base/thread_pool.h"

#include <stdbool.h>
#include <stddef.h>

struct consensus {
    size_t cell;                 /* edge of a cell in voxels */
    size_t n[3];                 /* number of cells */
    float (*tensor)[6];          /* sum of weight d d^T: xx yy zz xy xz yz */
    struct scratch_space *space; /* not owned; NULL: ordinary memory */
};

/* Makes cells of zeros over a volume of n_voxel. STATUS_NO_MEMORY, STATUS_DISK_FULL. */
status consensus_init(struct consensus *c, const size_t n_voxel[3], size_t cell, struct scratch_space *space,
                      struct error *err);
void consensus_release(struct consensus *c);
/* Adds direction d to the cell of voxel (i, j, k). Several threads may add at the same time to different layers of
 * cells (k / cell). */
void consensus_add(struct consensus *c, size_t i, size_t j, size_t k, const float d[3], float weight);
/* Applies the binomial filter 1 2 1 n_pass times along each axis. STATUS_NO_MEMORY. */
status consensus_blur(struct consensus *c, int n_pass, struct thread_pool *pool, struct error *err);
/* Writes the main direction around a voxel to d. Returns false where nothing was added. */
bool consensus_direction(const struct consensus *c, size_t i, size_t j, size_t k, float d[3]);

#endif
