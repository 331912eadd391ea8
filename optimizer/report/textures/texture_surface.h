/* The surface that a texture set describes, as OpenPBR has it: fuzz over a coat over a dielectric, whose microfacets
 * are rougher across the fibers than along them, over a diffuse base that lets light through (thin walled). Andersson
 * et al. 2024, "OpenPBR Surface specification" 1.1, as MaterialX 1.39 computes it: layers keep their albedo from those
 * below, the coat roughens the dielectric, and lobes are brighter by the light that microfacets reflect more
 * than once (Turquin 2019). Microfacets: Walter et al. 2007. */
#ifndef SELVEDGE_OPTIMIZER_TEXTURE_SURFACE_H
#define SELVEDGE_OPTIMIZER_TEXTURE_SURFACE_H

#include "optimizer/report/textures/texture_fit.h"

enum { TEXTURE_N_COSINE = 8 };

/* Albedo of microfacets by the cosine of a direction, in equal steps of [0, 1]: of the lobe, and of a white one. */
struct texture_lobe_albedo {
    double lobe[TEXTURE_N_COSINE], white[TEXTURE_N_COSINE];
};

struct texture_surface {
    const struct texture_maps *maps;
    struct texture_means means;
    double specular;                /* share of light that comes straight which the dielectric reflects */
    double specular_color[3];       /* factor on that light */
    double roughness, anisotropy;   /* the mean of the one and the largest of the other map */
    double base[3];                 /* mean base color */
    double fuzz[3], fuzz_roughness; /* color times weight */
    double coat_weight, coat_roughness;
    double normal_scale; /* factor on the slopes of the fibers; 1 once the maps have it */
    struct texture_lobe_albedo specular_albedo, coat_albedo;
    struct texture_error error; /* owned */
};

/* Fits the numbers; maps and means are given. Scales the normals of the maps as the fit says. STATUS_NO_MEMORY. */
status texture_surface_fit(struct texture_surface *t, struct texture_maps *maps, const struct texture_target *target,
                           struct error *err);
void texture_surface_release(struct texture_surface *t);

/* Radiance of a sample under a lamp of irradiance pi; as texture_model.reflect. */
void texture_surface_reflect(const void *surface, const struct texture_sample *s, const double wi[3],
                             const double wo[3], double rgb[3]);
/* Share of the light from straight above that reaches the base. */
double texture_surface_kept(const struct texture_surface *t);

/* Roughness and anisotropy of pixel i of the maps. */
double texture_surface_roughness(const struct texture_surface *t, size_t i);
double texture_surface_anisotropy(const struct texture_surface *t, size_t i);

/* Inputs of an OpenPBR surface that stand for `specular` under the coat: its index, and its weight where no index is
 * low enough; and the index of the coat. */
struct texture_open_pbr {
    double specular_ior, specular_weight, coat_ior, fuzz_weight;
};
struct texture_open_pbr texture_surface_inputs(const struct texture_surface *t);
/* Inputs of the OpenPBR surface that have no map, by their names in MaterialX. */
struct texture_input {
    const char *name;
    size_t n; /* 1: a number, 3: a color */
    double value[3];
};
enum { TEXTURE_N_INPUT = 10 };
void texture_surface_list(const struct texture_surface *t, struct texture_input input[TEXTURE_N_INPUT]);

/* GGX's density of the half vector h, for the widths ax and ay along tangent and bitangent, and Smith's Lambda of a
 * direction. */
double texture_ggx(const struct texture_sample *s, const double h[3], double ax, double ay);
double texture_smith(const struct texture_sample *s, const double w[3], double ax, double ay);
/* Reflected share of a dielectric whose share of light that comes straight is `straight`. */
double texture_fresnel(double cosine, double straight);

#endif
