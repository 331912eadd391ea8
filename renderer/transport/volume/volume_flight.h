/* The steps of a ray through a volume: free flights, the brick table, voxels. For volume_tracer.c. */
#ifndef SELVEDGE_RENDERER_VOLUME_FLIGHT_H
#define SELVEDGE_RENDERER_VOLUME_FLIGHT_H

#include "base/rng.h"
#include "renderer/scattering/phase_model.h"
#include "renderer/scene/fiber_frame.h"
#include "renderer/transport/volume/volume_scene.h"

/* -ln(1 - u) for u from rng_float, with an error below 2e-7 times the larger of 1 and the result. Exponent and mantissa
 * apart, the mantissa between sqrt(1/2) and sqrt(2) through ln((1 + x) / (1 - x)) = 2 (x + x^3 / 3 + ...). No call, no
 * branch. */
static inline float volume_flight_minus_log(float u)
{
    union {
        float f;
        uint32_t i;
    } x = {1 - u};
    uint32_t shifted = x.i - 0x3f3504f3u; /* sqrt(1/2) */
    float e = (float)((int32_t)shifted >> 23);
    x.i = (shifted & 0x7fffffu) + 0x3f3504f3u;
    float t = (x.f - 1) / (x.f + 1), t2 = t * t;
    float p = 2 + t2 * (0.66666667f + t2 * (0.4f + t2 * (0.28571429f + t2 * 0.22222222f)));
    return -(e * 0.69314718f + t * p);
}

/* Moves along the ray. False: out of the slab. */
static inline bool volume_flight_advance(const struct volume_scene *v, float step_mm, struct volume_ray *ray)
{
    for (int a = 0; a < 3; a++) ray->at[a] += step_mm * ray->per_mm[a];
    for (int a = 0; a < 2; a++)
        if (!(ray->at[a] >= 0 && ray->at[a] < v->n_voxel[a])) {
            float tiles = floorf(ray->at[a] / v->n_voxel[a]);
            ray->at[a] -= tiles * v->n_voxel[a];
            ray->offset_mm[a] += (double)tiles * (double)v->n_voxel[a] * (double)v->voxel_mm[a];
            if (!(ray->at[a] < v->n_voxel[a])) ray->at[a] = 0; /* rounding may put it on the far face */
        }
    return ray->at[2] >= v->low && ray->at[2] < v->high;
}

static inline const int32_t *volume_flight_brick(const struct volume_scene *v, const struct volume_ray *ray)
{
    int32_t i = (int32_t)ray->at[0] >> VOLUME_BRICK_SHIFT, j = (int32_t)ray->at[1] >> VOLUME_BRICK_SHIFT,
            k = (int32_t)ray->at[2] >> VOLUME_BRICK_SHIFT;
    return v->brick + (size_t)(k * v->n_brick[1] + j) * (size_t)v->n_brick[0] + i;
}

static inline const uint32_t *volume_flight_voxel(const struct volume_scene *v, int32_t brick,
                                                  const struct volume_ray *ray)
{
    const int32_t mask = VOLUME_BRICK_EDGE - 1;
    int32_t place = ((int32_t)ray->at[2] & mask) << 2 * VOLUME_BRICK_SHIFT |
                    ((int32_t)ray->at[1] & mask) << VOLUME_BRICK_SHIFT | ((int32_t)ray->at[0] & mask);
    return v->voxel + (size_t)brick * VOLUME_BRICK_VOXELS + place;
}

/* Distance to the end of the cube of empty bricks around the ray, or to the edge of the tile. Nothing scatters
 * before. */
static inline float volume_flight_empty_mm(const struct volume_scene *v, const struct volume_ray *ray, int32_t n_empty)
{
    const float most[3] = {v->n_voxel[0], v->n_voxel[1], v->high};
    const float least[3] = {0, 0, v->low};
    float t = INFINITY;
    for (int a = 0; a < 3; a++) {
        int32_t brick = (int32_t)ray->at[a] >> VOLUME_BRICK_SHIFT;
        bool up = ray->mm_per[a] > 0; /* sound for 0 and -0, too */
        float face = (float)((up ? brick + n_empty : brick - n_empty + 1) * VOLUME_BRICK_EDGE);
        face = up ? (face < most[a] ? face : most[a]) : (face > least[a] ? face : least[a]);
        float to = (face - ray->at[a]) * ray->mm_per[a];
        t = to < t ? to : t; /* false for 0 times infinity */
    }
    return t > 0 ? t : 0;
}

/* Extinction of a voxel that is not empty, for a ray of direction w: its ratio to the majorant, and the derivative of
 * that ratio by the parameter of s(w). inv_majorant_density: inverse of the density times s at which the ratio is 1. */
struct volume_lookup {
    float ratio, d_ratio, density, sine;
};

static inline struct volume_lookup volume_flight_look_up(const struct phase_extinction *e, float inv_majorant_density,
                                                         uint32_t voxel, const float w[3])
{
    struct volume_lookup l = {.density = volume_voxel_density(voxel)};
    float along[3], d_value = 0;
    volume_voxel_along(voxel, along);
    float c = fiber_frame_dot(along, w), rest = 1 - c * c / fiber_frame_dot(along, along);
    l.sine = sqrtf(rest > 0 ? rest : 0);
    float scale = l.density * inv_majorant_density, value = phase_extinction_at(e, l.sine, &d_value);
    l.ratio = scale * value;
    l.d_ratio = scale * d_value;
    return l;
}

#endif
