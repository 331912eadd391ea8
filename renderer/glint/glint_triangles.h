/* The reference of Gaussian elements: the normal map as triangles with linear normals, over which a footprint is
 * integrated (000, sections 3.4 to 3.6). Texels that cannot contribute are pruned by a quadtree of the least and the
 * largest normals.
 *
 * A texel has 2 triangles between the middles of texels, or 32 of its bicubic interpolation (n_split 1 or 4). In a flat
 * map the texel has one normal. */
#ifndef SELVEDGE_RENDERER_GLINT_TRIANGLES_H
#define SELVEDGE_RENDERER_GLINT_TRIANGLES_H

#include "renderer/glint/glint_map.h"

struct glint_bounds {
    float least[2], most[2];
};

enum { GLINT_TREE_LEVELS = 12 };

struct glint_triangles {
    const struct glint_map *map; /* the caller's */
    size_t n_split;
    float roughness;
    size_t n_level;
    struct glint_bounds *level[GLINT_TREE_LEVELS]; /* from n x n texels to 1 */
};

/* STATUS_NO_MEMORY. The map must outlive the triangles. */
status glint_triangles_make(const struct glint_map *m, size_t n_split, float roughness, struct glint_triangles *t,
                            struct error *err);
void glint_triangles_release(struct glint_triangles *t);

/* D at a normal. Gaussians count as 0 beyond five standard deviations. */
double glint_triangles_density(const struct glint_triangles *t, const struct glint_footprint *at, const float half[2]);

#endif
