/* Scattering by a film at a bounce of a path (renderer/scattering/film_facets.h): a film of the scene has its own
 * material, whatever model the fibers have, and no parameters that are fitted. v of the fiber frame is the normal of
 * its flat side. Inside of path_scatter.h, and for recorded paths. */
#ifndef SELVEDGE_RENDERER_PATH_FILM_H
#define SELVEDGE_RENDERER_PATH_FILM_H

#include "renderer/scattering/fiber_direction.h"
#include "renderer/scattering/film_glint.h"

/* S with the widths that the film shows: light f_r |wi.v| dwi as S cos th_i dwi. Returns the density of a sample. */
static inline float path_film_eval(const struct film_material *m, const float wi[3], const float wo[3], float s_rgb[3])
{
    const float pdf = film_facets_eval(m, wi, wo, s_rgb, NULL, NULL),
                cos_theta = fmaxf(sqrtf(wi[1] * wi[1] + wi[2] * wi[2]), FIBER_COS_MIN);
    for (int c = 0; c < 3; c++) s_rgb[c] *= fabsf(wi[1]) / cos_theta;
    return pdf;
}

/* The same of a film whose facets may be seen one by one. */
static inline float path_glint_eval(const struct film_material *m, const struct film_glint *g, const float wi[3],
                                    const float wo[3], float s_rgb[3])
{
    if (g->surface == NULL) return path_film_eval(m, wi, wo, s_rgb);
    const float pdf = film_glint_eval(m, g, wi, wo, s_rgb),
                cos_theta = fmaxf(sqrtf(wi[1] * wi[1] + wi[2] * wi[2]), FIBER_COS_MIN);
    for (int c = 0; c < 3; c++) s_rgb[c] *= fabsf(wi[1]) / cos_theta;
    return pdf;
}

#endif
