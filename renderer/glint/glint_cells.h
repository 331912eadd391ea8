/* The hierarchy over elements: (s, t) is divided into cells, and each has its own list of the elements that reach into
 * it, sorted by tiles of the lattice (000, section 3.9).
 *
 * A query has one normal and therefore needs one cell. The lists of the tiles of a row follow each other, so that
 * all elements of a row under the footprint are one range of them. Differs: the tree within a cell has two levels,
 * tiles and elements, because elements lie on a lattice. */
#ifndef SELVEDGE_RENDERER_GLINT_CELLS_H
#define SELVEDGE_RENDERER_GLINT_CELLS_H

#include "renderer/glint/glint_element.h"

enum { GLINT_N_CELL = 32 };

struct glint_cells {
    float least[2], per_cell[2]; /* cell = (normal - least) * per_cell */
    size_t n_tile;               /* along an edge of the lattice */
    uint32_t *start;             /* n_cell^2 x n_tile^2 + 1: by cell, then by tile */
    uint32_t *index;             /* of elements */
};

/* STATUS_NO_MEMORY. */
status glint_cells_make(const struct glint_lattice *l, struct glint_cells *c, struct error *err);
void glint_cells_release(struct glint_cells *c);

/* Sum over all elements of density / q->factor at a normal. */
float glint_cells_sum(const struct glint_cells *c, const struct glint_lattice *l, const struct glint_query *q,
                      const float half[2]);

#endif
