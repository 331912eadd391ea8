/* The surface of a texture set as the principled material of U3M has it: Burley 2012, "Physically Based Shading at
 * Disney", with the exact Fresnel reflection of a dielectric (Burley 2015), as Mitsuba 3 computes it: a diffuse base
 * that is brighter where light grazes, sheen, and microfacets that are rougher across the fibers. Unlike the base of
 * OpenPBR, this base keeps its brightness under the highlight, so it has its own map, and one of roughness. */
#ifndef SELVEDGE_OPTIMIZER_TEXTURE_PRINCIPLED_H
#define SELVEDGE_OPTIMIZER_TEXTURE_PRINCIPLED_H

#include "optimizer/report/textures/texture_surface.h"

struct texture_principled {
    const struct texture_maps *maps; /* whose normals have the scale of the OpenPBR surface */
    struct texture_means means;
    double specular;              /* 0.08 of it is the share of light that comes straight */
    double roughness, anisotropy; /* the mean of the one and the largest of the other map */
    double base[3];               /* mean base color */
    double sheen, sheen_tint;   /* sheen_tint: 0, white; 1, in the tint of the base. Sheen is above 1 on many cloths */
    double normal_scale;        /* factor on the slopes of the map of normals */
    struct texture_error error; /* owned */
};

/* Fits the numbers; maps and means are given. STATUS_NO_MEMORY. */
status texture_principled_fit(struct texture_principled *p, const struct texture_target *target, struct error *err);
/* Radiance of a sample under a lamp of irradiance pi; as texture_model.reflect. */
void texture_principled_reflect(const void *surface, const struct texture_sample *s, const double wi[3],
                                const double wo[3], double rgb[3]);
/* Roughness and anisotropy of pixel i of the maps. */
double texture_principled_roughness(const struct texture_principled *p, size_t i);
double texture_principled_anisotropy(const struct texture_principled *p, size_t i);
void texture_principled_release(struct texture_principled *p);

#endif
