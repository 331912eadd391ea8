/* The search for the direction with the least J of the line filter at one voxel. */
#ifndef SELVEDGE_GEOMETRY_LINE_DESCENT_H
#define SELVEDGE_GEOMETRY_LINE_DESCENT_H

#include "geometry/filter/line_filter.h"

struct line_descent {
    const struct direction_set *set;
    const struct line_filter *filter; /* made for `set` */
};

/* Steps from node `seed` of the set to the neighbour with the least J until no neighbour is lower, 24 steps at most.
 * Writes the direction, refined between the nodes, to d, and returns J at the best node. */
float line_descend(const struct line_descent *o, const struct line_filter_site *site, uint16_t seed, float d[3]);

#endif
