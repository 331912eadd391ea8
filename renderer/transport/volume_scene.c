#include "renderer/transport/volume_scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#ifndef MADV_COLLAPSE
#define MADV_COLLAPSE 25 /* Linux 6.1 */
#endif

/* Look-ups are all over the volume: large pages, where the system gives them, save it from looking up addresses too.
 * Only whole pages inside the array are touched, and no content changes; failure does no harm. */
static void use_large_pages(void *data, size_t n_bytes)
{
    const uintptr_t page = 2u << 20;
    uintptr_t first = ((uintptr_t)data + page - 1) & ~(page - 1), last = ((uintptr_t)data + n_bytes) & ~(page - 1);
    if (last <= first) return;
    if (madvise((void *)first, last - first, MADV_HUGEPAGE) == 0) /* NOLINT: advice only */
        madvise((void *)first, last - first, MADV_COLLAPSE);
}

static status fill_bricks(struct volume_scene *s, struct error *err)
{
    const size_t *n = s->volume->n;
    for (int a = 0; a < 3; a++) s->n_brick[a] = (n[a] + (1u << VOLUME_BRICK_SHIFT) - 1) >> VOLUME_BRICK_SHIFT;
    s->occupied = calloc((volume_n_voxel(s->n_brick) + 63) / 64, sizeof *s->occupied);
    if (s->occupied == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot trace a volume: out of memory");
    for (size_t k = 0; k < n[2]; k++)
        for (size_t j = 0; j < n[1]; j++) {
            const uint8_t *row = s->volume->density + volume_index(n, 0, j, k);
            size_t first = ((k >> VOLUME_BRICK_SHIFT) * s->n_brick[1] + (j >> VOLUME_BRICK_SHIFT)) * s->n_brick[0];
            for (size_t i = 0; i < n[0]; i++) {
                size_t b = first + (i >> VOLUME_BRICK_SHIFT);
                s->occupied[b >> 6] |= (uint64_t)(row[i] != 0) << (b & 63);
            }
        }
    return STATUS_OK;
}

status volume_scene_init(struct volume_scene *s, const struct direction_volume *v, const struct volume_scene_option *o,
                         struct error *err)
{
    memset(s, 0, sizeof *s);
    for (int a = 0; a < 3; a++)
        if (v->n[a] == 0 || v->n[a] > (1u << 24) || !(v->voxel_size_m[a] > 0))
            return error_set(err, STATUS_INVALID, "cannot trace a volume of %zu x %zu x %zu voxels", v->n[0], v->n[1],
                             v->n[2]);
    size_t layer = v->n[0] * v->n[1], low = v->n[2], high = 0;
    uint8_t most = 0;
    for (size_t k = 0; k < v->n[2]; k++) {
        uint8_t here = 0;
        for (size_t i = k * layer; i < (k + 1) * layer; i++) here = v->density[i] > here ? v->density[i] : here;
        if (here == 0) continue;
        most = here > most ? here : most;
        low = k < low ? k : low;
        high = k + 1;
    }
    if (most == 0) return error_set(err, STATUS_INVALID, "cannot trace a volume in which every voxel is empty");
    s->volume = v;
    for (int a = 0; a < 2; a++) s->n_voxel[a] = (float)v->n[a];
    for (int a = 0; a < 3; a++) s->voxel_mm[a] = (float)(1e3 * v->voxel_size_m[a]);
    s->low = (float)low;
    s->high = (float)high;
    s->largest_density = (float)most / 255;
    s->black_sheet = o->black_sheet;
    use_large_pages(v->density, volume_n_voxel(v->n) * sizeof *v->density);
    use_large_pages(v->octahedral, 2 * volume_n_voxel(v->n) * sizeof *v->octahedral);
    return fill_bricks(s, err);
}

void volume_scene_release(struct volume_scene *s)
{
    free(s->occupied);
    s->occupied = NULL;
}

size_t volume_scene_memory_bytes(const struct volume_scene *s)
{
    return sizeof *s + (volume_n_voxel(s->n_brick) + 63) / 64 * sizeof *s->occupied +
           volume_n_voxel(s->volume->n) * (sizeof *s->volume->density + 2 * sizeof *s->volume->octahedral);
}

double volume_scene_thickness_mm(const struct volume_scene *s) { return (double)((s->high - s->low) * s->voxel_mm[2]); }

void volume_ray_turn(const struct volume_scene *s, const float direction[3], struct volume_ray *ray)
{
    for (int a = 0; a < 3; a++) {
        ray->direction[a] = direction[a];
        ray->per_mm[a] = direction[a] / s->voxel_mm[a];
    }
}

bool volume_ray_enter(const struct volume_scene *s, const double origin_mm[3], const double direction[3],
                      struct volume_ray *ray)
{
    if (!(direction[2] < 0) || !(origin_mm[2] >= 0)) return false;
    double t = -origin_mm[2] / direction[2];
    float d[3] = {(float)direction[0], (float)direction[1], (float)direction[2]};
    for (int a = 0; a < 2; a++) {
        double x = origin_mm[a] + t * direction[a], tile = (double)s->n_voxel[a] * (double)s->voxel_mm[a];
        ray->offset_mm[a] = floor(x / tile) * tile;
        ray->at[a] = (float)((x - ray->offset_mm[a]) / (double)s->voxel_mm[a]);
    }
    ray->at[2] = s->high;
    volume_ray_turn(s, d, ray);
    return true;
}

void volume_ray_position_mm(const struct volume_scene *s, const struct volume_ray *ray, float position_mm[3])
{
    for (int a = 0; a < 2; a++) position_mm[a] = (float)((double)(ray->at[a] * s->voxel_mm[a]) + ray->offset_mm[a]);
    position_mm[2] = (ray->at[2] - s->high) * s->voxel_mm[2];
}
