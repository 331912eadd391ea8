#include "geometry/fibers/axes/model/nearest_rounds.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_ROUNDS = 3 };
static const double MOST_MOVED = 0.1; /* voxels */

bool nearest_rounds_start(struct nearest_rounds *r, size_t n_vertex)
{
    *r = (struct nearest_rounds){.before = malloc((n_vertex + 1) * sizeof *r->before)};
    return r->before != NULL;
}

void nearest_rounds_release(struct nearest_rounds *r)
{
    free(r->before);
    *r = (struct nearest_rounds){0};
}

struct round_kind nearest_rounds_next(struct nearest_rounds *r, bool is_last)
{
    const bool follows = r->n_round > 0 && r->n_round < MOST_ROUNDS && r->moved <= MOST_MOVED;
    const struct round_kind kind = {follows, r->before != NULL && !follows && !is_last};
    r->n_round = kind.follows ? r->n_round + 1 : kind.is_followed ? 1 : 0;
    return kind;
}

void nearest_rounds_before_step(struct nearest_rounds *r, const struct polyline_set *lines)
{
    if (r->before != NULL) memcpy(r->before, lines->vertex, lines->n_vertex * sizeof *r->before);
}

void nearest_rounds_after_step(struct nearest_rounds *r, const struct polyline_set *lines)
{
    double square = 0.0;
    if (r->before == NULL) return;
    for (size_t i = 0; i < lines->n_vertex; i++)
        for (int a = 0; a < 3; a++) {
            const double d = (double)lines->vertex[i][a] - (double)r->before[i][a];
            square += d * d;
        }
    r->moved = lines->n_vertex > 0 ? sqrt(square / (double)lines->n_vertex) : 0.0;
}
