/* Distributions of normals of tiles of the map, for footprints so large that their elements are too many: a
 * footprint then takes the mean of its tiles, weighted by the Gaussian at their middles. Levels halve the number of
 * tiles along an edge down to 1, whose table is the mean of the whole surface.
 *
 * A table holds densities at the nodes of a grid over (s, t), between which it is bilinear. Nodes are at least sigma_r
 * apart; the variance h^2 / 6 that the interpolation adds is taken off the elements' before. */
#ifndef SELVEDGE_RENDERER_GLINT_TABLES_H
#define SELVEDGE_RENDERER_GLINT_TABLES_H

#include "renderer/glint/glint_element.h"

/* The smallest tiles have at least 16 x 16 elements, and tables at most 96 x 96 nodes. Where the normals spread so far
 * that these are not fine enough, there are fewer and finer tables: few elements then have the normal of a query.
 * Levels: at most. */
enum { GLINT_TABLE_TILE = 16, GLINT_TABLE_NODES = 96, GLINT_TABLE_NODES_WIDE = 160, GLINT_TABLE_LEVELS = 6 };

struct glint_table_level {
    size_t n_tile;  /* along an edge of the map */
    float *density; /* n_tile^2 x nodes along t x nodes along s */
    float *row;     /* n_tile^2 x nodes along t: sums of rows */
};

struct glint_tables {
    size_t n_node[2];
    float least[2], step[2]; /* node i is at least + i step */
    float period_um;
    size_t n_level; /* from the smallest tiles to the whole */
    struct glint_table_level level[GLINT_TABLE_LEVELS];
};

/* STATUS_NO_MEMORY. */
status glint_tables_make(const struct glint_lattice *l, struct glint_tables *t, struct error *err);
void glint_tables_release(struct glint_tables *t);

/* Returns the level that a footprint is read from; NULL: its elements are few enough. */
const struct glint_table_level *glint_tables_level(const struct glint_tables *t, const struct glint_footprint *at);

/* D at a normal, and a sample with this density. */
float glint_tables_density(const struct glint_tables *t, const struct glint_table_level *level,
                           const struct glint_footprint *at, const float half[2]);
void glint_tables_draw(const struct glint_tables *t, const struct glint_table_level *level,
                       const struct glint_footprint *at, const float u[GLINT_N_NUMBER], float half[2]);

#endif
