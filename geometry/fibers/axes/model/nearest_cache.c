#include "geometry/fibers/axes/model/nearest_cache.h"

#include <malloc.h>
#include <stdlib.h>
#include <string.h>

bool nearest_cache_init(struct nearest_cache *s, size_t n_brick, size_t most_bytes)
{
    *s = (struct nearest_cache){.n_brick = n_brick, .most_bytes = most_bytes};
    atomic_init(&s->n_bytes, 0);
    s->brick = calloc(n_brick + 1, sizeof *s->brick);
    return s->brick != NULL;
}

void nearest_cache_release(struct nearest_cache *s)
{
    for (size_t b = 0; s->brick != NULL && b < s->n_brick; b++) {
        free(s->brick[b].cell);
        free(s->brick[b].first);
    }
    free(s->brick);
    s->brick = NULL;
    s->n_brick = 0;
    malloc_trim(0); /* thousands of small blocks, which would stay with the process */
}

void nearest_cache_add(struct nearest_cache *s, size_t i_brick, const struct nearest_list *nearest, size_t n_segment)
{
    struct stored_nearest *to = &s->brick[i_brick];
    const size_t cell_bytes = (nearest->first[n_segment] + LANES) * sizeof *to->cell,
                 first_bytes = (n_segment + 1) * sizeof *to->first;
    if (atomic_fetch_add(&s->n_bytes, cell_bytes + first_bytes) + cell_bytes + first_bytes > s->most_bytes) {
        atomic_fetch_sub(&s->n_bytes, cell_bytes + first_bytes);
        return;
    }
    to->cell = malloc(cell_bytes);
    to->first = malloc(first_bytes);
    if (to->cell == NULL || to->first == NULL) {
        free(to->cell);
        free(to->first);
        *to = (struct stored_nearest){NULL, NULL};
        return;
    }
    memcpy(to->cell, nearest->cell, cell_bytes);
    memcpy(to->first, nearest->first, first_bytes);
}

bool nearest_cache_find(const struct nearest_cache *s, size_t i_brick, struct nearest_list *nearest)
{
    if (s->brick == NULL || s->brick[i_brick].first == NULL) return false;
    *nearest = (struct nearest_list){s->brick[i_brick].cell, s->brick[i_brick].first};
    return true;
}
