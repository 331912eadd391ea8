/* Contacts: the nodes that a node of another fiber overlaps, and how they push it. */
#ifndef SELVEDGE_GEOMETRY_STRAND_CONTACT_H
#define SELVEDGE_GEOMETRY_STRAND_CONTACT_H

#include "geometry/cloth/strand_grid.h"
#include "geometry/cloth/strand_step.h"

struct strand_contacts {
    const struct strand_set *s;
    const struct strand_grid *grid; /* sorted by the present places */
    enum strand_rule rule;
    double *depth; /* deepest overlap of each node, over the sum of radii */
};

/* Computes push and depth of the nodes in one row of cells of the grid. */
void strand_contacts_of_row(const struct strand_contacts *c, size_t i_row, struct strand_push *push);

#endif
