/* The surface that a texture set describes, as OpenPBR has it: a diffuse base that lets light through (thin walled),
 * under a dielectric whose microfacets are rougher across the fibers than along them. Andersson et al. 2024, "OpenPBR
 * Surface specification" 1.1, sections "Dielectric base" and "Thin-walled"; microfacets: Walter et al. 2007, with the
 * anisotropy of OpenPBR. */
#ifndef SELVEDGE_OPTIMIZER_TEXTURE_SURFACE_H
#define SELVEDGE_OPTIMIZER_TEXTURE_SURFACE_H

#include "optimizer/report/textures/texture_fit.h"

struct texture_surface {
    const struct texture_maps *maps;
    struct texture_means means;
    double weight, roughness, anisotropy; /* specular_weight; the mean of the one and the largest of the other map */
    double specular_albedo;               /* the dielectric's reflected share of light that comes straight down */
    double kept;                          /* share of the light from the camera's side that reaches the base */
    double rel_rms[2];                    /* over the fitted and the held-out rows; NaN without such rows */
};

/* Fits weight, roughness and anisotropy; maps and means are given. STATUS_NO_MEMORY. */
status texture_surface_fit(struct texture_surface *t, const struct report *report, const struct pipeline_model *m,
                           struct error *err);

/* Roughness and anisotropy of pixel i of the maps. */
double texture_surface_roughness(const struct texture_surface *t, size_t i);
double texture_surface_anisotropy(const struct texture_surface *t, size_t i);

/* Mean base color: the share that must be reflected below the microfacets, so that both together reflect the albedo. */
double texture_surface_base(const struct texture_surface *t, size_t channel);

/* GGX's density of the half vector h, for the widths ax and ay along tangent and bitangent, and Smith's Lambda of a
 * direction. */
double texture_ggx(const struct texture_sample *s, const double h[3], double ax, double ay);
double texture_smith(const struct texture_sample *s, const double w[3], double ax, double ay);
/* Reflected share of a dielectric whose share of light that comes straight is `straight`. */
double texture_fresnel(double cosine, double straight);

#endif
