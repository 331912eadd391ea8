/* Sets of voxels as runs of indices in ascending order; no run goes beyond its row of voxels along x. */
#ifndef SELVEDGE_GEOMETRY_VOXEL_RUNS_H
#define SELVEDGE_GEOMETRY_VOXEL_RUNS_H

#include "base/thread_pool.h"
#include "geometry/volume/volume.h"

#include <stdbool.h>

/* Writes the runs of the voxels of a volume of n whose mark is not 0, if `run` is not NULL. Returns their number. */
size_t voxel_runs_of(const size_t n[3], const uint8_t *mark, struct volume_run *run);
/* Returns whether a voxel lies in one of n_run runs. */
bool voxel_runs_hold(const struct volume_run *run, size_t n_run, size_t voxel);
/* Sets the marks of all voxels to 0 that belong to a set of marked voxels, connected by their faces, of less than
 * `least` voxels. STATUS_NO_MEMORY. */
status voxel_marks_drop_small(const size_t n[3], size_t least, uint8_t *mark, struct error *err);
/* Counts the marked voxels of sets, connected by their faces, that are compact: of their ball of the same spread (RMS
 * distance of the voxels from their middle) they fill at least the share `least_fill`, and its radius is at most
 * `most_radius` voxels. A ball fills 1, two balls that touch 0.46, and a cylinder of 2, 3, 4, 5 or 10 diameters 0.56,
 * 0.32, 0.20, 0.13 or 0.04. STATUS_NO_MEMORY. */
status voxel_marks_count_compact(const size_t n[3], const uint8_t *mark, double least_fill, double most_radius,
                                 size_t *count, struct error *err);
/* Writes the squared distance of each voxel from the nearest one whose mark has one of `bits` into `square`: exact
 * below (reach + 1)^2, and at least that elsewhere. reach: at most 6 voxels. work: a byte for each voxel, changed too.
 * STATUS_CANCELLED. */
status voxel_marks_distance(const size_t n[3], const uint8_t *mark, uint8_t bits, int reach, struct thread_pool *pool,
                            uint8_t *work, uint8_t *square, struct error *err);

#endif
