/* The surface of a texture set as the principled material of U3M has it: Burley 2012, "Physically Based Shading at
 * Disney", with the exact Fresnel reflection of a dielectric (Burley 2015), as Mitsuba 3 computes it: a diffuse base
 * that is brighter where light grazes, sheen, and microfacets that are rougher across the fibers. Unlike the base of
 * OpenPBR, this base keeps its brightness under the highlight, so it has its own map. The other maps are OpenPBR's,
 * with factors. */
#ifndef SELVEDGE_OPTIMIZER_TEXTURE_PRINCIPLED_H
#define SELVEDGE_OPTIMIZER_TEXTURE_PRINCIPLED_H

#include "optimizer/report/textures/texture_surface.h"

struct texture_principled {
    const struct texture_surface *open_pbr; /* fitted before: its roughness and anisotropy are in the maps */
    double specular;                        /* 0.08 of it is the share of light that comes straight */
    double roughness, anisotropy;           /* factors of the maps of the OpenPBR surface */
    double base[3];                         /* mean base color */
    double sheen;                           /* in the tint of the base */
    double rel_rms[2];                      /* over the fitted and the held-out rows; NaN without such rows */
};

/* Fits the numbers. STATUS_NO_MEMORY. */
status texture_principled_fit(struct texture_principled *p, const struct report *report, const struct pipeline_model *m,
                              struct error *err);

#endif
