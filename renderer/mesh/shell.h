/* The shell of a bent cloth: prisms over the triangles of a mesh, each cut into three tetrahedra (Porumbescu et al.
 * 2005, "Shell maps"; fabric thesis 5.7.3).
 *
 * The mesh is the upper side of the cloth. Its points move along their normals up by margin_mm and down by the
 * thickness and margin_mm: these are the two ends of the prisms' edges. In every tetrahedron the map between the space
 * that is seen and the space of the flat cloth is affine, and neighbours agree on their common face. Diagonals of the
 * prisms' sides follow the numbers of positions, so that neighbours cut them alike. Millimetres.
 */
#ifndef SELVEDGE_RENDERER_SHELL_H
#define SELVEDGE_RENDERER_SHELL_H

#include "renderer/mesh/mesh.h"

#include <stdbool.h>

#define SHELL_NONE UINT32_MAX

struct shell_cell {
    double plane[4][4]; /* barycentric coordinate k at x: plane[k] . x + plane[k][3]; 0 on face k, opposite corner k */
    double to_cloth[3][4]; /* place in the flat cloth: to_cloth[a] . x + to_cloth[a][3] */
    float to_world[3][3];  /* of directions in the flat cloth */
    float scale;           /* length here over length in the flat cloth, the mean over directions */
    uint32_t neighbour[4]; /* behind face k; SHELL_NONE: outside */
    uint8_t bottom;        /* bit k: face k is a part of the lower side of the shell */
};

struct shell {
    size_t n_cell, n_node;
    struct shell_cell *cell;
    uint32_t (*corner)[4]; /* nodes of each cell */
    float (*node_mm)[3];   /* node 2 i is the lower end of position i, 2 i + 1 the upper one */
    size_t n_outer;        /* faces with nothing behind them */
    uint32_t (*outer)[3];  /* their nodes, counter-clockwise from outside */
    uint32_t *outer_cell;  /* the cell of each */
    bool *outer_bottom;    /* whether it is a part of the lower side */
    double low_mm[3], high_mm[3];
};

/* STATUS_INVALID: a cell without volume or one that is turned inside out, because the surface bends more tightly than
 * the cloth is thick there (names the triangle, from 1); what mesh_normals refuses. STATUS_NO_MEMORY. The mesh must
 * have passed mesh_check. */
status shell_new(const struct mesh *m, double thickness_mm, double margin_mm, struct shell *s, struct error *err);
void shell_release(struct shell *s);

#endif
