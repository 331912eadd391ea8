#include "geometry/cloth/strand.h"

#include <stdlib.h>
#include <string.h>

void strand_set_release(struct strand_set *s)
{
    free(s->strand);
    free(s->start);
    free(s->p);
    free(s->axis);
    *s = (struct strand_set){0};
}

static status grow_nodes(struct strand_set *s, size_t n, struct error *err)
{
    if (s->n_node + n <= s->node_capacity) return STATUS_OK;
    size_t capacity = 2 * s->node_capacity + n + 4096;
    void *start = realloc(s->start, capacity * sizeof *s->start);
    if (start != NULL) s->start = start;
    void *p = realloc(s->p, capacity * sizeof *s->p);
    if (p != NULL) s->p = p;
    void *axis = s->flat ? realloc(s->axis, capacity * sizeof *s->axis) : NULL;
    if (axis != NULL) s->axis = axis;
    if (start == NULL || p == NULL || (s->flat && axis == NULL))
        return error_set(err, STATUS_NO_MEMORY, "cannot make the fibers: out of memory");
    s->node_capacity = capacity;
    return STATUS_OK;
}

status strand_add(struct strand_set *s, const struct strand *like, size_t n, double (**node)[3], struct error *err)
{
    status st = grow_nodes(s, n, err);
    if (st != STATUS_OK) return st;
    if (s->n_strand == s->strand_capacity) {
        size_t capacity = 2 * s->strand_capacity + 64;
        void *grown = realloc(s->strand, capacity * sizeof *s->strand);
        if (grown == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make the fibers: out of memory");
        s->strand = grown;
        s->strand_capacity = capacity;
    }
    struct strand *new = &s->strand[s->n_strand++];
    *new = *like;
    new->first = s->n_node;
    new->n = n;
    memset(s->start + s->n_node, 0, n * sizeof *s->start);
    if (s->axis != NULL) memset(s->axis + s->n_node, 0, n * sizeof *s->axis);
    *node = s->start + s->n_node;
    s->n_node += n;
    return STATUS_OK;
}
