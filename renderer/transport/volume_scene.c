#include "renderer/transport/volume_scene.h"

#include <math.h>
#include <string.h>

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
    return STATUS_OK;
}

size_t volume_scene_memory_bytes(const struct volume_scene *s)
{
    return sizeof *s + volume_n_voxel(s->volume->n) * (sizeof *s->volume->density + 2 * sizeof *s->volume->octahedral);
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
