/* Facets of an opaque metal film, for film.v1 and for films among the fibers of a cloth.
 *
 * Frame: the fiber frame with v the normal of the flat side; both sides are alike. With n the side that wo sees,
 *
 *     f_r = F(i.h) D(h) G(i, o) / (4 (i.n) (o.n))        0 where i and o lie on different sides
 *     F   = C_F + (1 - C_F) (1 - i.h)^5                  Schlick 1994, for conductors
 *     D   = alpha^2 / (pi ((h.n)^2 (alpha^2 - 1) + 1)^2)  GGX: Walter, Marschner, Li and Torrance 2007, equation 33
 *     G   = 1 / (1 + Lambda(i) + Lambda(o))              height-correlated masking: Heitz 2014, equation 99
 *
 * in the form G / ((i.n) (o.n)) = 2 / ((o.n) s_i + (i.n) s_o), s = sqrt((w.n)^2 + alpha^2 (1 - (w.n)^2)), which has no
 * pole. Samples are reflected at facets that wo sees (Heitz 2018, "Sampling the GGX Distribution of Visible Normals");
 * their density over the whole sphere is D / (2 (o.n + s_o)). Directions of the sample that lie beyond the film carry
 * no light. Energy: the integral of f_r (o.n) over wo is at most 1. */
#ifndef SELVEDGE_RENDERER_FILM_FACETS_H
#define SELVEDGE_RENDERER_FILM_FACETS_H

#include "base/catalogue/film_material.h"

/* f_r in rgb. Returns the density of a sample per steradian. by_color: NULL, or the derivative of ln f_r of channel c
 * by its own color; by_alpha, then not NULL either: by alpha, for all channels. Both are 0 where f_r is. */
float film_facets_eval(const struct film_material *m, const float wi[3], const float wo[3], float f_rgb[3],
                       float by_color[3], float *by_alpha);
/* Draws wi for wo with u in [0, 1)^2. */
void film_facets_sample(const struct film_material *m, const float wo[3], const float u[2], float wi[3]);

#endif
