/* An endless cloth as a volume: the density and direction of every voxel, periodic in x and y, a slab in z, empty
 * outside.
 *
 * Frame: the cloth frame in millimetres, z shifted so that the top of the highest layer that holds anything is z = 0
 * (as with fibers, up to a voxel). Inside, positions are in voxels. Immutable: shared by threads.
 *
 * Storage, made for reads in random order: bricks of 4^3 voxels, a voxel in 4 bytes (8 bits of density, a direction of
 * 12 + 12 bits, right within 0.035 degrees), a brick in 4 cache lines. Bricks that hold nothing are not stored; in
 * place of an empty brick the table has the distance to the nearest brick with material, so that rays skip empty
 * bricks. The direction volume (5 bytes a voxel) is not needed afterwards. */
#ifndef SELVEDGE_RENDERER_VOLUME_SCENE_H
#define SELVEDGE_RENDERER_VOLUME_SCENE_H

#include "base/ranks/byte_pack.h"
#include "geometry/volume/volume.h"
#include "renderer/mesh/mesh.h"
#include "renderer/mesh/shell_walk.h"

#include <math.h>
#include <stdbool.h>

enum {
    VOLUME_BRICK_SHIFT = 2,
    VOLUME_BRICK_EDGE = 1 << VOLUME_BRICK_SHIFT,
    VOLUME_BRICK_VOXELS = VOLUME_BRICK_EDGE * VOLUME_BRICK_EDGE * VOLUME_BRICK_EDGE,
    VOLUME_EMPTY_MAX = 32
};

/* The shell of a cloth that is laid on a mesh (volume_bent.h). */
struct volume_bent {
    struct shell_space space;
};

struct volume_scene {
    size_t n[3];
    double voxel_size_m[3];
    float n_voxel[2]; /* across the tile */
    float voxel_mm[3];
    float low, high;       /* z of the slab, in voxels */
    float largest_density; /* in [0, 1] */
    int32_t n_brick[3];
    int32_t *brick;  /* owned; x fastest: number of the stored brick, or -e when it is empty and so are all bricks less
                        than e away along every axis (the tile's edges count as empty) */
    uint32_t *voxel; /* owned; VOLUME_BRICK_VOXELS a stored brick, x fastest: density << 24 | q << 12 | p */
    size_t n_stored; /* bricks */
    bool black_sheet;
    uint64_t number;          /* that no other volume scene of this process has had */
    struct volume_bent *bent; /* owned; NULL: the cloth is flat. Otherwise brick and voxel belong to the flat one */
};

struct volume_scene_option {
    bool black_sheet; /* true: light that passes the cloth downwards is absorbed and none comes from below */
};

/* v is copied and may be released. STATUS_NO_MEMORY; STATUS_INVALID for a volume without anything in it, or with more
 * than 2^24 voxels along an edge or 2^31 bricks. */
status volume_scene_init(struct volume_scene *scene, const struct direction_volume *v,
                         const struct volume_scene_option *o, struct error *err);
/* bent: like flat, which must outlive it, on the mesh; its origin is the orbit centre. black_sheet: one lies under all
 * of it. Errors as scene_bend (renderer/scene/scene.h). volume_scene_release in any case. */
status volume_scene_bend(const struct volume_scene *flat, const struct mesh *mesh, bool black_sheet,
                         struct volume_scene *bent, struct error *err);
void volume_scene_release(struct volume_scene *scene);
/* A flat scene as bytes, and the same scene made of them by another process. STATUS_FORMAT, STATUS_NO_MEMORY; the scene
 * is released on failure. */
void volume_scene_pack(const struct volume_scene *scene, struct byte_pack *pack);
status volume_scene_unpack(struct byte_view *view, struct volume_scene *scene, struct error *err);
/* Everything that the scene holds. */
size_t volume_scene_memory_bytes(const struct volume_scene *scene);
double volume_scene_thickness_mm(const struct volume_scene *scene);

/* Density in [0, 1] of a stored voxel, and its direction, unit. */
static inline float volume_voxel_density(uint32_t voxel) { return (float)(voxel >> 24) * (1 / 255.0f); }

/* (A direction and its opposite mean the same fiber, so all point up: the upper half of the octahedron, turned by 45
 * degrees, fills the square of both coordinates.) */
static inline void volume_voxel_along(uint32_t voxel, float d[3]) /* of any length */
{
    float p = (float)((int32_t)(voxel & 4095) - 2047) * (0.5f / 2047),
          q = (float)((int32_t)(voxel >> 12 & 4095) - 2047) * (0.5f / 2047);
    d[0] = p + q;
    d[1] = p - q;
    d[2] = 1 - fabsf(d[0]) - fabsf(d[1]);
}

static inline void volume_voxel_direction(uint32_t voxel, float d[3])
{
    volume_voxel_along(voxel, d);
    float scale = 1 / sqrtf(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    for (int a = 0; a < 3; a++) d[a] *= scale;
}

/* Voxel (i, j, k) of the volume that the scene was made from; 0 when nothing is there. */
uint32_t volume_scene_voxel(const struct volume_scene *scene, size_t i, size_t j, size_t k);

/* A ray at a point inside the cloth. */
struct volume_ray {
    double offset_mm[2]; /* whole tiles */
    float at[3];         /* voxels, x and y within the tile */
    float direction[3];  /* unit, in the cloth frame */
    float per_mm[3];     /* voxels a millimetre along it */
    float mm_per[3];     /* its inverse */
};

/* Ray from a point above (mm), brought to the top of the slab. False when it does not go down. */
bool volume_ray_enter(const struct volume_scene *scene, const double origin_mm[3], const double direction[3],
                      struct volume_ray *ray);
void volume_ray_turn(const struct volume_scene *scene, const float direction[3], struct volume_ray *ray);
/* Position of the ray with its whole-tile offset. */
void volume_ray_position_mm(const struct volume_scene *scene, const struct volume_ray *ray, float position_mm[3]);

#endif
