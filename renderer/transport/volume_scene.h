/* An endless cloth as a volume: the density and direction of every voxel, periodic in x and y, a slab in z, empty
 * outside.
 *
 * Frame: the cloth frame in millimetres, z shifted so that the top of the highest layer that holds anything is z = 0
 * (as with fibers, up to a voxel). Inside, positions are in voxels. Immutable: shared by threads. Memory: the direction
 * volume is used as it is stored (5 bytes a voxel) and must outlive the scene; beside it there is nothing that grows
 * with it.
 */
#ifndef SELVEDGE_RENDERER_VOLUME_SCENE_H
#define SELVEDGE_RENDERER_VOLUME_SCENE_H

#include "geometry/volume/volume.h"

#include <math.h>
#include <stdbool.h>

struct volume_scene {
    const struct direction_volume *volume;
    float n_voxel[2]; /* across the tile */
    float voxel_mm[3];
    float low, high;       /* z of the slab, in voxels */
    float largest_density; /* in [0, 1] */
    uint64_t *occupied;    /* owned; one bit a brick, x fastest */
    size_t n_brick[3];
    bool black_sheet;
};

struct volume_scene_option {
    bool black_sheet; /* true: light that passes the cloth downwards is absorbed and none comes from below */
};

enum { VOLUME_BRICK_SHIFT = 2 };

/* STATUS_NO_MEMORY; STATUS_INVALID for a volume without anything in it, or with more than 2^24 voxels along an edge. */
status volume_scene_init(struct volume_scene *scene, const struct direction_volume *v,
                         const struct volume_scene_option *o, struct error *err);
void volume_scene_release(struct volume_scene *scene);
/* Everything the scene needs, the volume included. */
size_t volume_scene_memory_bytes(const struct volume_scene *scene);
double volume_scene_thickness_mm(const struct volume_scene *scene);

/* False: this voxel and its neighbours in the brick are empty. */
static inline bool volume_scene_may_hold(const struct volume_scene *s, size_t i, size_t j, size_t k)
{
    size_t b = ((k >> VOLUME_BRICK_SHIFT) * s->n_brick[1] + (j >> VOLUME_BRICK_SHIFT)) * s->n_brick[0] +
               (i >> VOLUME_BRICK_SHIFT);
    return (s->occupied[b >> 6] >> (b & 63) & 1) != 0;
}

/* direction_volume_get, in line for the inner loop (same map; divides by 32767 as a product). */
static inline void volume_scene_direction(const struct volume_scene *s, size_t i_voxel, float d[3])
{
    float u = (float)s->volume->octahedral[2 * i_voxel] * (1 / 32767.0f),
          w = (float)s->volume->octahedral[2 * i_voxel + 1] * (1 / 32767.0f), z = 1 - fabsf(u) - fabsf(w);
    float fold = z < 0 ? z : 0; /* below the equator the corners are folded in */
    u += copysignf(1, u) * fold;
    w += copysignf(1, w) * fold;
    float scale = 1 / sqrtf(u * u + w * w + z * z);
    d[0] = u * scale;
    d[1] = w * scale;
    d[2] = z * scale;
}

/* A point on its way through the cloth. */
struct volume_ray {
    double offset_mm[2]; /* whole tiles */
    float at[3];         /* voxels, x and y within the tile */
    float direction[3];  /* unit, in the cloth frame */
    float per_mm[3];     /* voxels a millimetre along it */
};

/* Ray from a point above (mm), brought to the top of the slab. False when it does not go down. */
bool volume_ray_enter(const struct volume_scene *scene, const double origin_mm[3], const double direction[3],
                      struct volume_ray *ray);
void volume_ray_turn(const struct volume_scene *scene, const float direction[3], struct volume_ray *ray);
/* Where the ray really is. */
void volume_ray_position_mm(const struct volume_scene *scene, const struct volume_ray *ray, float position_mm[3]);

#endif
