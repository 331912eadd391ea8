#include "geometry/fibers/tiles/tile_chains.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct chain {
    const struct tile_ends *e;
    const struct tile_lines *l;
    struct tile_lines *out;
    struct tile_vertex *vertex; /* of the chain, not wrapped */
    size_t n, room, source;
    bool *is_used; /* of each line */
};

static status add(struct chain *c, const struct tile_vertex *v, const double offset[2], struct error *err)
{
    if (c->n == c->room) {
        struct tile_vertex *vertex = realloc(c->vertex, (2 * c->room + 1024) * sizeof *vertex);
        if (vertex == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make a large tile: out of memory");
        c->vertex = vertex;
        c->room = 2 * c->room + 1024;
    }
    c->vertex[c->n] = *v;
    for (int a = 0; a < 2; a++) c->vertex[c->n].p[a] += offset[a];
    c->n++;
    return STATUS_OK;
}

/* Follows partners from an end on, which becomes the first of the chain. *closed: the chain comes back to it. */
static status follow(struct chain *c, size_t end, bool *closed, struct error *err)
{
    double offset[2] = {0.0, 0.0};
    c->n = 0;
    *closed = false;
    for (size_t at = end;;) {
        const size_t line = at / 2, first = c->l->first[line], n = c->l->first[line + 1] - first;
        c->is_used[line] = true;
        for (size_t k = c->n > 0 ? 1 : 0; k < n; k++) {
            status s = add(c, &c->l->vertex[at % 2 == 0 ? first + k : first + n - 1 - k], offset, err);
            if (s != STATUS_OK) return s;
        }
        const size_t out = at ^ 1, next = c->e->partner[out];
        if (next == SIZE_MAX) return STATUS_OK;
        if (c->is_used[next / 2]) {
            *closed = next == end;
            return STATUS_OK;
        }
        for (int a = 0; a < 2; a++) { /* partners lie at one place, but for whole tiles */
            const double d = c->e->end[next].p[a] - c->e->end[out].p[a];
            offset[a] -= c->e->tile_m[a] * round(d / c->e->tile_m[a]);
        }
        at = next;
    }
}

static long tile_of(const struct chain *c, const double p[3], int a) { return (long)floor(p[a] / c->e->tile_m[a]); }

static struct tile_vertex moved(const struct chain *c, const struct tile_vertex *v, const long tile[2])
{
    struct tile_vertex out = *v;
    for (int a = 0; a < 2; a++) out.p[a] -= (double)tile[a] * c->e->tile_m[a];
    return out;
}

/* The share of a segment after which it leaves the tile, and through which face. 1: it does not. */
static double leaves(const struct chain *c, const double p[3], const double q[3], const long tile[2], int *axis,
                     int *step)
{
    double least = 1.0;
    for (int a = 0; a < 2; a++)
        for (int side = 0; side < 2; side++) {
            const double face = (double)(tile[a] + side) * c->e->tile_m[a], rate = q[a] - p[a];
            if ((side == 0 && rate >= 0.0) || (side == 1 && rate <= 0.0)) continue;
            const double at = (face - p[a]) / rate;
            if (at >= least || at < 0.0) continue;
            least = at;
            *axis = a;
            *step = side == 0 ? -1 : 1;
        }
    return least;
}

/* Writes the chain as lines within the tile. */
static status emit(struct chain *c, struct error *err)
{
    long tile[2] = {tile_of(c, c->vertex[0].p, 0), tile_of(c, c->vertex[0].p, 1)};
    struct tile_vertex v = moved(c, &c->vertex[0], tile);
    status s = tile_lines_add(c->out, &v, err);
    for (size_t k = 0; k + 1 < c->n && s == STATUS_OK; k++) {
        struct tile_vertex from = c->vertex[k];
        const struct tile_vertex *to = &c->vertex[k + 1];
        for (int guard = 0; guard < 8 && s == STATUS_OK; guard++) {
            int axis = 0, step = 0;
            const double share = leaves(c, from.p, to->p, tile, &axis, &step);
            if (share >= 1.0) break;
            for (int a = 0; a < 3; a++) from.p[a] += share * (to->p[a] - from.p[a]);
            from.p[axis] = (double)(tile[axis] + (step > 0 ? 1 : 0)) * c->e->tile_m[axis];
            v = moved(c, &from, tile);
            s = tile_lines_add(c->out, &v, err);
            if (s == STATUS_OK) s = tile_lines_end(c->out, c->source, false, false, err);
            tile[axis] += step;
            v = moved(c, &from, tile);
            if (s == STATUS_OK) s = tile_lines_add(c->out, &v, err);
        }
        v = moved(c, to, tile);
        if (s == STATUS_OK) s = tile_lines_add(c->out, &v, err);
    }
    return s == STATUS_OK ? tile_lines_end(c->out, c->source, false, false, err) : s;
}

/* Turns a closed chain so that it begins where it first leaves its tile: it then has no joint within the tile. */
static status turn_closed(struct chain *c, struct error *err)
{
    const size_t n = c->n - 1; /* the last vertex is the first one, but for whole tiles */
    double around[2];
    size_t start = 0;
    for (int a = 0; a < 2; a++) around[a] = c->vertex[n].p[a] - c->vertex[0].p[a];
    while (start < n && tile_of(c, c->vertex[start].p, 0) == tile_of(c, c->vertex[start + 1].p, 0) &&
           tile_of(c, c->vertex[start].p, 1) == tile_of(c, c->vertex[start + 1].p, 1))
        start++;
    if (start == n) return STATUS_OK;
    /* from the vertex before the face, all around, to the vertex behind it; the piece before the face is cut off */
    for (size_t k = 1; k <= start + 1; k++) {
        status s = add(c, &c->vertex[k], around, err);
        if (s != STATUS_OK) return s;
    }
    struct tile_vertex *first = &c->vertex[start];
    const struct tile_vertex *second = first + 1;
    const long tile[2] = {tile_of(c, first->p, 0), tile_of(c, first->p, 1)};
    int axis = 0, step = 0;
    const double share = leaves(c, first->p, second->p, tile, &axis, &step);
    for (int a = 0; a < 3; a++) first->p[a] += share * (second->p[a] - first->p[a]);
    first->p[axis] = (double)(tile[axis] + (step > 0 ? 1 : 0)) * c->e->tile_m[axis] + 1e-12 * step;
    struct tile_vertex *last = &c->vertex[c->n - 1];
    *last = *first;
    for (int a = 0; a < 2; a++) last->p[a] += around[a];
    last->p[axis] -= 2e-12 * step;
    c->n -= start;
    memmove(c->vertex, c->vertex + start, c->n * sizeof *c->vertex);
    return STATUS_OK;
}

/* Whether a closed chain goes around the large tile. Others are loops of short pieces beside a cut, and are dropped. */
static bool goes_around(const struct chain *c)
{
    double most = 0.0;
    for (int a = 0; a < 2; a++) most = fmax(most, fabs(c->vertex[c->n - 1].p[a] - c->vertex[0].p[a]) / c->e->tile_m[a]);
    return most > 0.5;
}

static status make_chain(struct chain *c, size_t end, struct error *err)
{
    bool closed;
    if (c->is_used[end / 2]) return STATUS_OK;
    c->source = c->l->source[end / 2];
    status s = follow(c, end, &closed, err);
    if (s == STATUS_OK && closed && !goes_around(c)) return STATUS_OK;
    if (s == STATUS_OK && closed) s = turn_closed(c, err);
    return s == STATUS_OK ? emit(c, err) : s;
}

status tile_chains_make(const struct tile_ends *e, const struct tile_lines *l, struct tile_lines *out,
                        struct error *err)
{
    struct chain c = {.e = e, .l = l, .out = out, .is_used = calloc(l->n_line + 1, sizeof(bool))};
    status s =
        c.is_used != NULL ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot make a large tile: out of memory");
    /* chains with two free ends first, then closed ones */
    for (size_t i = 0; i < e->n && s == STATUS_OK; i++)
        if (e->partner[i] == SIZE_MAX) s = make_chain(&c, i, err);
    for (size_t i = 0; i < e->n && s == STATUS_OK; i += 2) s = make_chain(&c, i, err);
    free(c.is_used);
    free(c.vertex);
    return s;
}
