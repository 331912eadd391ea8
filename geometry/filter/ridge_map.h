/* Ridges of a volume: the voxels where the climbs from all voxels of material end (filter_rows.c). Each voxel of
 * material has the offset to its ridge, and each ridge a direction and J. */
#ifndef SELVEDGE_GEOMETRY_RIDGE_MAP_H
#define SELVEDGE_GEOMETRY_RIDGE_MAP_H

#include "base/thread_pool.h"
#include "geometry/volume/volume.h"
#include "geometry/volume/voxel_bits.h"

struct ridge_map {
    size_t n[3], n_climb;              /* n_climb: most steps along each axis to a ridge, at most 19 */
    struct voxel_bits material, ridge; /* voxels of material, and those that are a ridge */
    uint16_t *offset;                  /* per voxel of material: packed offset of its ridge */
    uint16_t *j;                       /* per ridge: J as a share of J in solid material, in units of 1 / 40000 */
    struct direction_volume direction; /* per ridge */
    struct scratch_space *space;       /* not owned */
};

/* Makes a map without ridges for the voxels of v with a density of eps_d and more. STATUS_NO_MEMORY,
 * STATUS_DISK_FULL. */
status ridge_map_init(struct ridge_map *m, const struct volume *v, float eps_d, size_t n_climb,
                      struct thread_pool *pool, struct error *err);
void ridge_map_release(struct ridge_map *m);
/* Marks voxel x as the ridge of voxel `from`. Several threads may do so. */
void ridge_map_mark(struct ridge_map *m, const size_t from[3], const size_t x[3]);
/* Once all are marked, makes room for their J and directions. STATUS_NO_MEMORY, STATUS_DISK_FULL. */
status ridge_map_list(struct ridge_map *m, struct error *err);
bool ridge_map_is_ridge(const struct ridge_map *m, size_t at);
/* Voxel of the ridge of a voxel of material. */
size_t ridge_map_top(const struct ridge_map *m, size_t at);
/* Place of a ridge in the lists. */
size_t ridge_map_place(const struct ridge_map *m, size_t at);
/* J of a ridge, as a share of J in solid material. */
double ridge_map_share(const struct ridge_map *m, size_t at);
void ridge_map_set_share(struct ridge_map *m, size_t at, double share);

#endif
