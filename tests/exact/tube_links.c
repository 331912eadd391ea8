#include "tests/exact/tube_links.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Ends that are nearer than this share of their radius are one. */
static const double same_place_radii = 0.5;

/* An end of a fiber: 2 i + 1 is the last vertex of fiber i. */
static const float *end_at(const struct fiber_set *f, size_t e)
{
    return f->position_m + 3 * (e % 2 == 0 ? f->first_vertex[e / 2] : f->first_vertex[e / 2 + 1] - 1);
}

/* The end that lies where e does, up to whole tiles, which are added to its place. SIZE_MAX: there is none. */
static size_t partner_of(const struct fiber_set *f, size_t e, int tiles[2])
{
    const float *p = end_at(f, e);
    const double most = same_place_radii * (double)f->radius_m[e / 2];
    for (size_t o = 0; o < 2 * f->n_fiber; o++) {
        const float *q = end_at(f, o);
        double away2 = 0.0;
        if (o == e) continue;
        for (int k = 0; k < 3; k++) {
            double x = (double)p[k] - (double)q[k];
            if (k < 2) {
                tiles[k] = (int)floor(x / f->tile_size_m[k] + 0.5);
                x -= tiles[k] * f->tile_size_m[k];
            }
            away2 += x * x;
        }
        if (away2 < most * most) return o;
    }
    return SIZE_MAX;
}

/* Goes on from an end of a fiber of the chain until the chain ends. True: it has come back to its first fiber. */
static bool walk(struct tube_links *l, const struct fiber_set *f, size_t first, size_t e)
{
    int at[2] = {l->place[e / 2][0], l->place[e / 2][1]}, tiles[2];
    for (;;) {
        const size_t o = partner_of(f, e, tiles), i = o / 2;
        if (o == SIZE_MAX) return false;
        for (int k = 0; k < 2; k++) at[k] += tiles[k];
        if (i == first) {
            memcpy(l->period[first], at, sizeof at);
            return true;
        }
        if (l->chain[i] != UINT32_MAX) return false; /* three ends in one place: the first two are one */
        l->chain[i] = (uint32_t)first;
        memcpy(l->place[i], at, sizeof at);
        e = o ^ 1;
    }
}

bool tube_links_find(struct tube_links *l, const struct fiber_set *f)
{
    l->chain = malloc(f->n_fiber * sizeof *l->chain);
    l->place = calloc(f->n_fiber, sizeof *l->place);
    l->period = calloc(f->n_fiber, sizeof *l->period);
    if (l->chain == NULL || l->place == NULL || l->period == NULL) return false;
    for (size_t i = 0; i < f->n_fiber; i++) l->chain[i] = UINT32_MAX;
    for (size_t i = 0; i < f->n_fiber; i++) {
        if (l->chain[i] != UINT32_MAX) continue;
        l->chain[i] = (uint32_t)i;
        if (!walk(l, f, i, 2 * i + 1)) walk(l, f, i, 2 * i);
    }
    return true;
}

void tube_links_release(struct tube_links *l)
{
    free(l->chain);
    free(l->place);
    free(l->period);
    memset(l, 0, sizeof *l);
}

struct tube tube_of(const struct tube_links *l, uint32_t i_fiber, const int shift[2])
{
    const uint32_t chain = l->chain[i_fiber];
    const int *period = l->period[chain], *place = l->place[i_fiber];
    struct tube t = {chain, {shift[0] - place[0], shift[1] - place[1]}};
    const int square = period[0] * period[0] + period[1] * period[1];
    if (square == 0) return t;
    const int along = t.copy[0] * period[0] + t.copy[1] * period[1];
    const int times = along >= 0 ? along / square : -((square - 1 - along) / square);
    for (int k = 0; k < 2; k++) t.copy[k] -= times * period[k];
    return t;
}
