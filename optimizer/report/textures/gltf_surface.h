/* The surface of a texture set as a glTF 2.0 material has it: a diffuse base under microfacets that are rougher along
 * one direction, sheen over both, and a clear coat, whose normal is the mesh's. Khronos 2021, "glTF 2.0 Specification",
 * appendix B, with KHR_materials_specular, KHR_materials_anisotropy, KHR_materials_sheen and KHR_materials_clearcoat.
 * Where these leave a choice, viewers by three.js decide: masking of both directions together (Heitz 2014), sheen with
 * the visibility of Ashikhmin and Premoze (2007), an anisotropy whose frame keeps the tangent of the mesh, and
 * highlights that are brighter by what a rough surface sends back after several reflections (Fdez-Aguera 2019).
 *
 * The direction of the anisotropy is one for all pixels: viewers show the mean of a map from afar, and the mean of the
 * directions of weft and warp is neither. */
#ifndef SELVEDGE_OPTIMIZER_GLTF_SURFACE_H
#define SELVEDGE_OPTIMIZER_GLTF_SURFACE_H

#include "optimizer/report/textures/texture_fit.h"

enum { GLTF_N_COSINE = 24 };

struct gltf_surface {
    const struct texture_maps *maps;
    struct texture_means means;
    double f0[3], f90;               /* reflected share of light that comes straight, and of grazing light */
    double roughness;                /* factor of the map of spreads */
    double anisotropy, rotation_rad; /* strength, and direction of the greater width, from the weft */
    double across_rad;               /* direction across most fibers */
    double base[3];                  /* mean base color */
    double sheen[3], sheen_roughness;
    double coat, coat_roughness;
    double sheen_albedo[GLTF_N_COSINE]; /* of sheen of color 1, by the cosine of a direction in equal steps of [0, 1] */
    double lobe_albedo[GLTF_N_COSINE][GLTF_N_COSINE]; /* of a highlight without Fresnel, by roughness and cosine */
    double normal_scale;        /* factor on the slopes of the fibers, which the maps have after the fit */
    struct texture_error error; /* owned */
};

/* Fits the numbers; maps and means are given. Scales the normals of the maps as the fit says. STATUS_NO_MEMORY. */
status gltf_surface_fit(struct gltf_surface *g, struct texture_maps *maps, const struct texture_target *target,
                        struct error *err);
void gltf_surface_release(struct gltf_surface *g);
/* Roughness of pixel i of the maps. */
double gltf_surface_roughness(const struct gltf_surface *g, size_t i);
/* Radiance of a sample under a lamp of irradiance pi; as texture_model.reflect. */
void gltf_surface_reflect(const void *surface, const struct texture_sample *s, const double wi[3], const double wo[3],
                          double rgb[3]);
/* Sets the table of the sheen's albedo for its roughness. */
void gltf_surface_set_sheen(struct gltf_surface *g, double sheen_roughness);

#endif
