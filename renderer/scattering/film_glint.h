/* A film whose facets are seen one by one: D of film_facets.h is the distribution of normals under the footprint of a
 * pixel (renderer/glint/glint_surface.h; 000, equation 3.1). D there is a density over the disk of projected normals,
 * which for a GGX surface is the D of film_facets.h. Masking stays as for GGX.
 *
 * Samples: with probability GLINT_SHARE at a normal of D, whose density per steradian of wi is D |h.n| / (4 |o.h|),
 * else at a facet of GGX; the density is the mixture's. */
#ifndef SELVEDGE_RENDERER_FILM_GLINT_H
#define SELVEDGE_RENDERER_FILM_GLINT_H

#include "base/rng.h"
#include "renderer/glint/glint_surface.h"
#include "renderer/glint/wave_glint.h"
#include "renderer/scattering/film_facets.h"

struct film_glint {
    const struct glint_surface *surface; /* NULL: the film is smooth, as film_facets.h has it */
    const struct wave_glint *waves;      /* NULL: geometric optics; else f_r is by waves at center_um, times F */
    struct glint_footprint at;           /* u along the film, v across it */
};

/* The footprint, on a film at center_um, of a pixel of the given standard deviation across the view towards wo. */
void film_glint_see(struct film_glint *g, const float center_um[2], float pixel_um, const float wo[3]);
/* As film_facets_eval without derivatives, and film_facets_sample. */
float film_glint_eval(const struct film_material *m, const struct film_glint *g, const float wi[3], const float wo[3],
                      float f_rgb[3]);
void film_glint_sample(const struct film_material *m, const struct film_glint *g, const float wo[3], struct rng *rng,
                       float wi[3]);

#endif
