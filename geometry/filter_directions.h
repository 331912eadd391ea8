/* Directions of the fibers on one grid (head of filter_directions.c). */
#ifndef SELVEDGE_GEOMETRY_FILTER_DIRECTIONS_H
#define SELVEDGE_GEOMETRY_FILTER_DIRECTIONS_H

#include "geometry/reconstruct.h"

/* Computes d from v, whose fibers are diameter_voxel thick. Options that are left to the data are chosen from v and
 * written back. Counts the voxels of material and those kept. STATUS_INVALID when no voxel is kept (reconstruct.h);
 * STATUS_CANCELLED, STATUS_NO_MEMORY, STATUS_DISK_FULL. */
status filter_directions(const struct volume *v, double diameter_voxel, struct reconstruct_option *option,
                         struct thread_pool *pool, const struct progress *progress, struct direction_volume *d,
                         struct reconstruct_report *report, struct error *err);

/* The same for rows row[0] .. row[1] - 1 of v alone, with options that are chosen. v holds what surrounds them:
 * filter_directions_halo rows to both sides, unless it ends there, and a first row that is a multiple of
 * filter_directions_alignment in the whole volume. Then the rows are the same, bit by bit, as those of the whole
 * volume; other rows of d are not. */
status filter_directions_rows(const struct volume *v, const size_t row[2], double diameter_voxel,
                              const struct reconstruct_option *option, struct thread_pool *pool,
                              const struct progress *progress, struct direction_volume *d, struct error *err);
size_t filter_directions_halo(const struct reconstruct_option *option, double diameter_voxel);
size_t filter_directions_alignment(double diameter_voxel);

#endif
