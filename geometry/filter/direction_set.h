/* Directions spread evenly over the half sphere, where d and -d are the same, with the data of a descent over them: the
 * nearest neighbours of each, and the least-squares fit of a paraboloid to values at them. */
#ifndef SELVEDGE_GEOMETRY_DIRECTION_SET_H
#define SELVEDGE_GEOMETRY_DIRECTION_SET_H

#include "base/status.h"

#include <stdint.h>

enum { DIRECTION_NEIGHBOURS = 8 };

struct direction_node {
    float d[3], e1[3], e2[3]; /* e1, e2: tangent frame */
    uint16_t neighbour[DIRECTION_NEIGHBOURS];
    float fit[5][DIRECTION_NEIGHBOURS]; /* (f_i - f_0) -> g1 g2 h11 h12 h22 of f = f_0 + g.u + u.H.u / 2 */
    float reach;                        /* distance to the farthest neighbour, radians */
};

struct direction_set {
    size_t n;
    struct direction_node *node;
    float *component[3]; /* of all nodes, beside each other, for the search of the nearest */
};

/* Makes n directions on a Fibonacci spiral, 32 <= n <= 65535. STATUS_NO_MEMORY, STATUS_INVALID. */
status direction_set_init(struct direction_set *s, size_t n, struct error *err);
void direction_set_release(struct direction_set *s);
size_t direction_set_nearest(const struct direction_set *s, const float d[3]);
/* Writes the direction of the minimum of the paraboloid through value_0 at node i and value[] at its neighbours; it
 * stays within reach / 2 of the node. */
void direction_set_refine(const struct direction_set *s, size_t i, float value_0,
                          const float value[DIRECTION_NEIGHBOURS], float d[3]);

#endif
