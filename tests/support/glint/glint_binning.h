/* The oracle of distributions of normals: a histogram of the normals at random places of a footprint (000, section 3.5,
 * "Comparison against reference"). Of the library it uses the map alone, and interpolates it on its own. */
#ifndef SELVEDGE_TESTS_GLINT_BINNING_H
#define SELVEDGE_TESTS_GLINT_BINNING_H

#include "renderer/glint/glint_map.h"

enum { GLINT_BINNING_N = 48 };
#define GLINT_BINNING_EDGE 0.4

/* Shares of n normals in N x N bins of [-EDGE, EDGE]^2, rows along t. o is as for glint_surface_new. */
void glint_binning(const struct glint_option *o, const struct glint_footprint *f, size_t n, uint64_t seed,
                   double share[GLINT_BINNING_N * GLINT_BINNING_N]);

/* The normal of a map at a place in texels: the texel's, or Catmull-Rom's cubic between the middles of texels. */
void glint_binning_normal(const struct glint_map *m, double u, double v, double normal[2]);

#endif
