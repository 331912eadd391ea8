/* One path of light through a fiber with an elliptical section and a rough wall: where a ray meets the wall it meets a
 * facet, whose normal is drawn; the walk gives the light that leaves after one crossing (TT), after two (TRT), and the
 * rest.
 *
 * ellipse_ray.h defines section and lengths. A facet has the slopes (p, q) along the fiber and around it, normal (p, q,
 * 1) before scaling; slopes are normally distributed with the standard deviation r / sqrt(2) each (Beckmann's
 * distribution of roughness r). Facets are met in proportion to the area that they show to the ray, so a facet with the
 * normal m has the weight (w . m)+ / <(w . m)+> (Heitz and d'Eon 2014, "Importance Sampling Microfacet-Based BSDFs
 * using the Distribution of Visible Normals"), of mean 1. Reflectances and refractions are taken at the facet.
 */
#ifndef SELVEDGE_RENDERER_MICROFACET_WALK_H
#define SELVEDGE_RENDERER_MICROFACET_WALK_H

enum { MICROFACET_TT, MICROFACET_TRT, MICROFACET_N_INNER };
enum { MICROFACET_N_MEETING = 3 }; /* facets that are met on the way to TRT */

struct microfacet_fiber {
    double eta, roughness, major, minor; /* r; semi-axes along v and w, of product 1 */
};

/* The random numbers of a path. */
struct microfacet_draw {
    double phi, offset;                    /* azimuth of the light; place across the width, in [-1, 1] */
    double slope[MICROFACET_N_MEETING][2]; /* p and q over their standard deviation */
};

struct microfacet_exit {
    double share, length; /* without absorption; way inside */
    double azimuth, off;  /* of exit less azimuth of the light, any turn; th_i + th_o */
    double lean;          /* sum of the drawn p of all facets that were met */
};

struct microfacet_path {
    double width; /* half of the width that the section shows to the light */
    struct microfacet_exit exit[MICROFACET_N_INNER];
    double rest, rest_length; /* light that TRT leaves inside; way to the end of its next crossing */
};

struct microfacet_fiber microfacet_fiber_of(double eta, double ratio, double roughness);
void microfacet_walk(const struct microfacet_fiber *f, double theta, const struct microfacet_draw *draw,
                     struct microfacet_path *path);

#endif
