#include "renderer/scene/scene_ends.h"

#include <math.h>
#include <stdlib.h>

#define NONE SIZE_MAX
/* Ends that lie this part of a radius apart are one place: coordinates are rounded to less. */
static const double same_place = 1e-2;

struct end {
    uint32_t i_segment;
    bool after;
    float radius_mm;
    double at_mm[3]; /* x and y within the tile */
    int tile[2];     /* from the centre tile */
    size_t other;    /* the end that lies in the same place, or NONE */
};

/* Distance of two places along an axis on which the cloth repeats. */
static double apart(double x, double y, double period)
{
    const double d = fabs(x - y);
    return fmin(d, period - d);
}

static int by_height(const void *a, const void *b)
{
    const struct end *x = *(struct end *const *)a, *y = *(struct end *const *)b;
    if (x->at_mm[2] != y->at_mm[2]) return x->at_mm[2] < y->at_mm[2] ? -1 : 1;
    return (x > y) - (x < y);
}

/* Joins each end with the first free one of its place, from the lowest end to the highest. Returns how many are
 * joined. */
static size_t join(struct end *end, size_t n, struct end **sorted, const double tile_mm[2])
{
    size_t n_joined = 0;
    for (size_t i = 0; i < n; i++) {
        struct end *x = sorted[i];
        const double near = same_place * (double)x->radius_mm;
        for (size_t k = i + 1; k < n && x->other == NONE; k++) {
            struct end *y = sorted[k];
            if (y->at_mm[2] - x->at_mm[2] > near) break;
            if (y->other != NONE || apart(x->at_mm[0], y->at_mm[0], tile_mm[0]) > near ||
                apart(x->at_mm[1], y->at_mm[1], tile_mm[1]) > near)
                continue;
            x->other = (size_t)(y - end);
            y->other = (size_t)(x - end);
            n_joined += 2;
        }
    }
    return n_joined;
}

static struct end end_of(const struct scene *s, uint32_t i, bool after)
{
    const struct scene_vertex *v = &s->vertex[s->segment_vertex[i] + (after ? 1u : 0u)];
    struct end e = {.i_segment = i,
                    .after = after,
                    .radius_mm = v->radius,
                    .at_mm = {(double)v->x, (double)v->y, (double)v->z},
                    .other = NONE};
    for (int a = 0; a < 2; a++) {
        e.tile[a] = (int)floor(e.at_mm[a] / s->tile_mm[a]);
        e.at_mm[a] -= e.tile[a] * s->tile_mm[a];
    }
    return e;
}

static struct scene_link link_of(const struct end *x, const struct end *y, const double tile_mm[2])
{
    struct scene_link l = {
        .i_segment = x->i_segment, .i_other = y->i_segment, .after = x->after, .other_after = y->after};
    for (int a = 0; a < 2; a++)
        l.copy[a] = (int8_t)(x->tile[a] - y->tile[a] + (int)lround((x->at_mm[a] - y->at_mm[a]) / tile_mm[a]));
    return l;
}

static size_t list_ends(const struct scene *s, struct end *end)
{
    size_t n = 0;
    for (uint32_t i = 0; i < s->n_segment; i++)
        for (int after = 0; after < 2; after++) {
            const unsigned flag = after ? RTC_CURVE_FLAG_NEIGHBOR_RIGHT : RTC_CURVE_FLAG_NEIGHBOR_LEFT;
            if ((s->segment_flag[i] & flag) != 0) continue;
            if (end != NULL) end[n] = end_of(s, i, after);
            n++;
        }
    return n;
}

status scene_ends_new(const struct scene *s, struct scene_ends **ends, struct error *err)
{
    const size_t n = list_ends(s, NULL);
    struct end *end = malloc(n * sizeof *end), **sorted = malloc(n * sizeof(struct end *));
    struct scene_ends *e = calloc(1, sizeof *e);
    status st = STATUS_OK;
    if (end != NULL && sorted != NULL && e != NULL) {
        list_ends(s, end);
        for (size_t i = 0; i < n; i++) sorted[i] = &end[i];
        qsort(sorted, n, sizeof(struct end *), by_height);
        const size_t n_joined = join(end, n, sorted, s->tile_mm);
        e->link = malloc((n_joined + 1) * sizeof *e->link);
    }
    if (e == NULL || e->link == NULL)
        st = error_set(err, STATUS_NO_MEMORY, "cannot build scene: no memory for %zu ends of fibers", n);
    for (size_t i = 0; i < n && st == STATUS_OK; i++)
        if (end[i].other != NONE) e->link[e->n++] = link_of(&end[i], &end[end[i].other], s->tile_mm);
    free(end);
    free(sorted);
    *ends = e;
    return st;
}

void scene_ends_free(struct scene_ends *ends)
{
    if (ends != NULL) free(ends->link);
    free(ends);
}

const struct scene_link *scene_ends_find(const struct scene_ends *ends, uint32_t i_segment, bool after)
{
    size_t low = 0, high = ends->n; /* the first end at or after this one */
    while (low < high) {
        const size_t middle = (low + high) / 2;
        const struct scene_link *l = &ends->link[middle];
        if (l->i_segment < i_segment || (l->i_segment == i_segment && !l->after && after))
            low = middle + 1;
        else
            high = middle;
    }
    const struct scene_link *l = &ends->link[low];
    return low < ends->n && l->i_segment == i_segment && l->after == after ? l : NULL;
}
