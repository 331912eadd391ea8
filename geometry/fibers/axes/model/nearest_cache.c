#include "geometry/fibers/axes/model/nearest_cache.h"

#include <stdlib.h>
#include <string.h>

bool claim_store_init(struct claim_store *s, size_t n_brick, size_t most_bytes)
{
    *s = (struct claim_store){.n_brick = n_brick, .most_bytes = most_bytes};
    atomic_init(&s->n_bytes, 0);
    s->brick = calloc(n_brick + 1, sizeof *s->brick);
    return s->brick != NULL;
}

void claim_store_release(struct claim_store *s)
{
    for (size_t b = 0; s->brick != NULL && b < s->n_brick; b++) {
        free(s->brick[b].cell);
        free(s->brick[b].first);
    }
    free(s->brick);
    s->brick = NULL;
    s->n_brick = 0;
}

void claim_store_add(struct claim_store *s, size_t i_brick, const struct claim_list *claims, size_t n_segment)
{
    struct stored_claims *to = &s->brick[i_brick];
    const size_t cell_bytes = (claims->first[n_segment] + LANES) * sizeof *to->cell,
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
        *to = (struct stored_claims){NULL, NULL};
        return;
    }
    memcpy(to->cell, claims->cell, cell_bytes);
    memcpy(to->first, claims->first, first_bytes);
}

bool claim_store_find(const struct claim_store *s, size_t i_brick, struct claim_list *claims)
{
    if (s->brick == NULL || s->brick[i_brick].first == NULL) return false;
    *claims = (struct claim_list){s->brick[i_brick].cell, s->brick[i_brick].first};
    return true;
}
