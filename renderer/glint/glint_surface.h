/* Glints by geometric optics: the distribution D of the normals that a pixel sees on a surface with a normal map of
 * micrometres (000, chapter 3; README.md has the equations).
 *
 * Normals are points of the unit disk, as the projection (s, t) of a unit vector on the surface: there D needs no
 * cosine and integrates to 1 over the plane. The part beyond the unit disk, which a rough normal near the rim has, is
 * lost: glint_density returns 0 there, and a path whose sample lies there ends. With half vector h, D replaces the
 * distribution of a microfacet model (equation 3.1):
 *
 *     f_r = F G D(h) / (4 (i.n) (o.n)),   pdf of wo = D(h) |h.n| / (4 |wi.h|)
 *
 * where |h.n| turns the measure of the disk into a solid angle of h, and 1 / (4 |wi.h|) this one into one of wo.
 *
 * The map repeats after glint_period_um. A surface is immutable after glint_surface_new and shared by threads. */
#ifndef SELVEDGE_RENDERER_GLINT_SURFACE_H
#define SELVEDGE_RENDERER_GLINT_SURFACE_H

#include "renderer/glint/glint_option.h"

struct glint_surface;

/* STATUS_INVALID names the option; STATUS_NO_MEMORY. */
status glint_surface_new(const struct glint_option *o, struct glint_surface **out, struct error *err);
void glint_surface_free(struct glint_surface *s);
float glint_period_um(const struct glint_surface *s);

/* D(half): density of normals on the plane of (s, t), equation 3.6; 0 from |half| = 1 on. */
float glint_density(const struct glint_surface *s, const struct glint_footprint *at, const float half[2]);

/* Draws a normal from u, uniform in [0, 1). Its density is glint_pdf. */
void glint_sample(const struct glint_surface *s, const struct glint_footprint *at, const float u[GLINT_N_NUMBER],
                  float half[2]);
/* Density of glint_sample; equal to glint_density. */
float glint_pdf(const struct glint_surface *s, const struct glint_footprint *at, const float half[2]);

#endif
