/* Directions of the fibers in some rows of one grid: a slab of a volume, or all of it (head of filter_rows.c). */
#ifndef SELVEDGE_GEOMETRY_FILTER_ROWS_H
#define SELVEDGE_GEOMETRY_FILTER_ROWS_H

#include "base/progress.h"
#include "base/thread_pool.h"
#include "geometry/grade/reconstruct_option.h"
#include "geometry/volume/volume.h"

/* Computes directions d for rows row[0] .. row[1] - 1 of v, whose fibers are diameter_voxel thick, with options that
 * are chosen (filter_choice.h). v holds their surroundings: filter_rows_halo rows to both sides, unless the whole
 * volume ends there, and a first row that is a multiple of filter_rows_alignment in the whole volume. Then the rows
 * equal the rows of the whole volume bit by bit; other rows of d do not. row NULL: all rows, and d has kept voxels
 * alone (volume.h). STATUS_CANCELLED, STATUS_NO_MEMORY, STATUS_DISK_FULL. */
status filter_rows(const struct volume *v, const size_t *row, double diameter_voxel,
                   const struct reconstruct_option *option, struct thread_pool *pool, const struct progress *progress,
                   struct direction_volume *d, struct error *err);
size_t filter_rows_halo(const struct reconstruct_option *option, double diameter_voxel);
size_t filter_rows_alignment(double diameter_voxel);

#endif
