#include "geometry/filter/line_descent.h"

enum { MAX_STEP = 24 };

/* Cache of the values of J at a voxel. */
struct j_cache {
    size_t n;
    uint16_t node[MAX_STEP * DIRECTION_NEIGHBOURS + 1];
    float value[MAX_STEP * DIRECTION_NEIGHBOURS + 1];
};

static float cached_j(const struct line_descent *o, const struct line_filter_site *site, struct j_cache *m,
                      uint16_t node)
{
    for (size_t i = m->n; i-- > 0;)
        if (m->node[i] == node) return m->value[i];
    float j = line_filter_j(o->filter, site, node);
    m->node[m->n] = node;
    m->value[m->n++] = j;
    return j;
}

float line_descend(const struct line_descent *o, const struct line_filter_site *site, uint16_t seed, float d[3])
{
    struct j_cache m = {.n = 0};
    uint16_t here = seed;
    float value = cached_j(o, site, &m, here), around[DIRECTION_NEIGHBOURS];
    for (int step = 0; step < MAX_STEP; step++) {
        const struct direction_node *node = &o->set->node[here];
        uint16_t best = here;
        float least = value;
        for (int k = 0; k < DIRECTION_NEIGHBOURS; k++) {
            around[k] = cached_j(o, site, &m, node->neighbour[k]);
            if (around[k] < least) {
                least = around[k];
                best = node->neighbour[k];
            }
        }
        if (best == here || step == MAX_STEP - 1) break;
        here = best;
        value = least;
    }
    direction_set_refine(o->set, here, value, around, d);
    return value;
}
