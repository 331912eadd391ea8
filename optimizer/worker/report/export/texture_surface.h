/* The surface that a texture set describes, as OpenPBR has it: a diffuse base that lets light through (thin walled),
 * under a dielectric whose microfacets are rougher across the fibers than along them. Andersson et al. 2024, "OpenPBR
 * Surface specification" 1.1, sections "Dielectric base" and "Thin-walled"; microfacets: Walter et al. 2007, with the
 * anisotropy of OpenPBR.
 *
 * Weight, roughness and anisotropy are those with which the mean over the maps comes nearest to the renderings of the
 * fitted rows. */
#ifndef SELVEDGE_OPTIMIZER_TEXTURE_SURFACE_H
#define SELVEDGE_OPTIMIZER_TEXTURE_SURFACE_H

#include "optimizer/worker/pipeline_context.h"
#include "optimizer/worker/report/export/texture_maps.h"

struct texture_surface {
    const struct texture_maps *maps;
    double albedo[3], transmission[3];    /* means of the maps of reflected and transmitted light, for even light */
    double weight, roughness, anisotropy; /* specular_weight; the mean of the one and the largest of the other map */
    double specular_albedo;               /* what the dielectric reflects of light that comes straight down */
    double fit_rel_rms, heldout_rel_rms;  /* NaN without such rows */
};

/* Fits the three numbers; maps, albedo and transmission are given. STATUS_NO_MEMORY. */
status texture_surface_fit(struct texture_surface *t, const struct pipeline_context *c, const struct pipeline_model *m,
                           struct error *err);

/* Of pixel i of the maps. */
double texture_surface_roughness(const struct texture_surface *t, size_t i);
double texture_surface_anisotropy(const struct texture_surface *t, size_t i);

#endif
