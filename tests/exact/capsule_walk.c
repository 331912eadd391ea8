/* Rays through the tubes of a cloth. */
#include "tests/exact/capsule_entry.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { MOST_STEPS = 4000000 };
/* Intervals of one tube that are not farther apart are one: a piece of a ray ends where the next begins, but for
 * rounding. */
static const double same_place_mm = 1e-10;

static void too_many(const char *what, int most)
{
    fprintf(stderr, "a ray is inside more than %d %s\n", most, what);
    abort();
}

/* One straight piece of a ray: d is a unit vector, and t counts from o. */
struct piece {
    const struct capsule_cloth *c;
    double o[3], d[3], t0, t1;
};

static bool is_collected(const struct capsule_walk *w, uint32_t i_capsule, const int shift[2])
{
    for (size_t i = 0; i < w->n_part; i++) {
        const struct capsule_part *x = &w->part[i];
        if (x->i_capsule == i_capsule && x->shift[0] == shift[0] && x->shift[1] == shift[1]) return true;
    }
    return false;
}

/* Collects the parts of a piece inside the capsules of a cell. */
static void collect(struct capsule_walk *w, const struct piece *p, const int at[3])
{
    int tile[2];
    const size_t cell = capsule_cell(p->c, at, tile);
    for (uint32_t e = p->c->first[cell]; e < p->c->first[cell + 1]; e++) {
        const struct capsule_entry *entry = &p->c->entry[e];
        const int shift[2] = {tile[0] + entry->shift[0], tile[1] + entry->shift[1]};
        if (is_collected(w, entry->i_capsule, shift)) continue;
        double t[2];
        const double from[3] = {p->o[0] - shift[0] * p->c->tile_mm[0], p->o[1] - shift[1] * p->c->tile_mm[1], p->o[2]};
        if (!capsule_interval(&p->c->capsule[entry->i_capsule], from, p->d, t) || t[1] <= p->t0 || t[0] >= p->t1)
            continue;
        if (w->n_part == CAPSULE_MOST_INTERVALS) too_many("segments", CAPSULE_MOST_INTERVALS);
        w->part[w->n_part++] =
            (struct capsule_part){fmax(t[0], p->t0), fmin(t[1], p->t1), entry->i_capsule, {shift[0], shift[1]}};
    }
}

static int compare(const void *pa, const void *pb)
{
    const struct capsule_part *a = pa, *b = pb;
    if (a->from != b->from) return a->from < b->from ? -1 : 1;
    return a->i_capsule < b->i_capsule ? -1 : a->i_capsule > b->i_capsule; /* the earlier segment has their joint */
}

/* The index of a tube among those that contain the start; n_open: it is none of them. */
static size_t find_open(const struct capsule_walk *w, const struct tube *t)
{
    size_t i = 0;
    while (i < w->n_open && (w->open[i].tube.chain != t->chain || w->open[i].tube.copy[0] != t->copy[0] ||
                             w->open[i].tube.copy[1] != t->copy[1]))
        i++;
    return i;
}

/* Joins the intervals that begin by t_known, up to where all of them are known, to the tubes that the ray starts in.
 * True: one belongs to none of these. */
static bool find_entrance(struct capsule_walk *w, const struct piece *p, double t_known,
                          struct capsule_entrance *entrance)
{
    size_t kept = 0;
    qsort(w->part, w->n_part, sizeof *w->part, compare);
    for (size_t i = 0; i < w->n_part; i++) {
        const struct capsule_part *x = &w->part[i];
        if (x->from > t_known) {
            w->part[kept++] = *x;
            continue;
        }
        const struct tube tube = tube_of(&p->c->links, p->c->fiber[x->i_capsule], x->shift);
        const size_t i_open = find_open(w, &tube);
        if (i_open < w->n_open && x->from <= w->open[i_open].to + same_place_mm) {
            w->open[i_open].to = fmax(w->open[i_open].to, x->to);
        } else if (x->from <= w->slack) {
            if (w->n_open == CAPSULE_MOST_OPEN) too_many("tubes", CAPSULE_MOST_OPEN);
            w->open[w->n_open].tube = tube;
            w->open[w->n_open++].to = x->to;
        } else {
            *entrance = (struct capsule_entrance){x->from, x->i_capsule, {x->shift[0], x->shift[1]}};
            return true;
        }
    }
    w->n_part = kept;
    return false;
}

static bool walk_cells(struct capsule_walk *w, const struct piece *p, const double t[2],
                       struct capsule_entrance *entrance)
{
    const struct capsule_cloth *c = p->c;
    double next[3];
    int at[3];
    for (int k = 0; k < 3; k++) {
        at[k] = (int)floor((p->o[k] + t[0] * p->d[k] - c->low_mm[k]) / c->cell_mm[k]);
        if (k == 2) at[k] = at[k] < 0 ? 0 : at[k] >= c->n_cell[k] ? c->n_cell[k] - 1 : at[k];
        next[k] = INFINITY;
        if (p->d[k] != 0.0) next[k] = (c->low_mm[k] + (at[k] + (p->d[k] > 0.0)) * c->cell_mm[k] - p->o[k]) / p->d[k];
    }
    for (int step = 0; step < MOST_STEPS; step++) {
        const int k = next[0] < next[1] ? (next[0] < next[2] ? 0 : 2) : next[1] < next[2] ? 1 : 2;
        collect(w, p, at);
        if (w->n_part > 0 && find_entrance(w, p, fmin(next[k], t[1]), entrance)) return true;
        if (next[k] >= t[1]) return false;
        at[k] += p->d[k] > 0.0 ? 1 : -1;
        if (k == 2 && (at[k] < 0 || at[k] >= c->n_cell[k])) return false;
        next[k] = (c->low_mm[k] + (at[k] + (p->d[k] > 0.0)) * c->cell_mm[k] - p->o[k]) / p->d[k];
    }
    return false; /* it has run along the cloth for so long that it is taken to have left */
}

bool capsule_walk_piece(struct capsule_walk *w, const struct capsule_cloth *c, const double o[3], const double d[3],
                        double t0, double t1, struct capsule_entrance *entrance)
{
    const double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]), low = c->low_mm[2],
                 high = low + c->n_cell[2] * c->cell_mm[2];
    struct piece p = {.c = c, .t0 = t0 * length, .t1 = t1 * length};
    for (int k = 0; k < 3; k++) {
        p.o[k] = o[k];
        p.d[k] = d[k] / length;
    }
    double t[2] = {p.t0, p.t1};
    if (p.d[2] != 0.0) {
        t[0] = fmax(t[0], fmin((low - o[2]) / p.d[2], (high - o[2]) / p.d[2]));
        t[1] = fmin(t[1], fmax((low - o[2]) / p.d[2], (high - o[2]) / p.d[2]));
    } else if (o[2] < low || o[2] > high)
        return false;
    const double scale = 1.0 / length, slack = w->slack;
    for (size_t i = 0; i < w->n_open; i++) w->open[i].to *= length;
    w->slack *= length;
    w->n_part = 0;
    const bool met = t[0] <= t[1] && walk_cells(w, &p, t, entrance);
    for (size_t i = 0; i < w->n_open; i++) w->open[i].to *= scale;
    w->slack = slack;
    if (met) entrance->t *= scale;
    return met;
}
