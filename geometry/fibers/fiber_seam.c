#include "geometry/fibers/fiber_seam.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static const double FADE_RADII = 8.0, JOIN_RADII = 2.0, SAME_COSINE = 0.7071;

struct end {
    size_t i_fiber;
    bool last;         /* the fiber's last vertex instead of its first */
    double p[3], t[3]; /* t: unit tangent, outwards */
    double radius;
};

struct pair {
    double distance;
    size_t low, high; /* indices of an end at face 0 and of one at the opposite face */
};

struct seam {
    const struct fiber_set *f;
    int axis;
    struct end *end[2];
    size_t n[2];
    struct pair *pair; /* matched pairs, nearest first */
    size_t n_pair;
};

static struct end end_of(const struct fiber_set *f, size_t i, bool last)
{
    size_t n = f->first_vertex[i + 1] - f->first_vertex[i], back = n > 4 ? 3 : n - 1;
    size_t at = last ? f->first_vertex[i + 1] - 1 : f->first_vertex[i], inner = last ? at - back : at + back;
    struct end e = {.i_fiber = i, .last = last, .radius = (double)f->radius_m[i]};
    double norm = 0.0;
    for (size_t a = 0; a < 3; a++) {
        e.p[a] = (double)f->position_m[3 * at + a];
        e.t[a] = e.p[a] - (double)f->position_m[3 * inner + a];
        norm += e.t[a] * e.t[a];
    }
    for (int a = 0; a < 3; a++) e.t[a] /= norm > 0.0 ? sqrt(norm) : 1.0;
    return e;
}

/* Distance in the plane of the face, periodic along its in-plane axis. */
static double distance(const struct seam *s, const struct end *a, const struct end *b)
{
    int other = 1 - s->axis;
    double tile = s->f->tile_size_m[other], u = b->p[other] - a->p[other];
    u -= tile * round(u / tile);
    return hypot(u, b->p[2] - a->p[2]);
}

static int by_distance(const void *a, const void *b)
{
    const struct pair *x = a, *y = b;
    if (x->distance != y->distance) return x->distance < y->distance ? -1 : 1;
    if (x->low != y->low) return x->low < y->low ? -1 : 1;
    return x->high < y->high ? -1 : x->high > y->high;
}

static int by_height(const void *a, const void *b)
{
    const struct end *x = a, *y = b;
    return (x->p[2] > y->p[2]) - (x->p[2] < y->p[2]);
}

static status collect_ends(struct seam *s, struct error *err)
{
    double tile = s->f->tile_size_m[s->axis];
    for (int side = 0; side < 2; side++) {
        s->end[side] = malloc(2 * s->f->n_fiber * sizeof *s->end[side]);
        if (s->end[side] == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot measure the seams: out of memory");
    }
    for (size_t i = 0; i < s->f->n_fiber; i++)
        for (int last = 0; last < 2; last++) {
            struct end e = end_of(s->f, i, last == 1);
            if (e.p[s->axis] <= e.radius && e.t[s->axis] < 0.0)
                s->end[0][s->n[0]++] = e;
            else if (e.p[s->axis] >= tile - e.radius && e.t[s->axis] > 0.0)
                s->end[1][s->n[1]++] = e;
        }
    for (int side = 0; side < 2; side++) qsort(s->end[side], s->n[side], sizeof *s->end[side], by_height);
    return STATUS_OK;
}

static status add_pair(struct seam *s, size_t *capacity, struct pair p, struct error *err)
{
    if (s->n_pair == *capacity) {
        size_t more = *capacity == 0 ? 1024 : 2 * *capacity;
        struct pair *bigger = realloc(s->pair, more * sizeof *bigger);
        if (bigger == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot measure the seams: out of memory");
        s->pair = bigger;
        *capacity = more;
    }
    s->pair[s->n_pair++] = p;
    return STATUS_OK;
}

/* Finds all pairs within reach (ends are sorted by height), then matches the nearest first. */
static status match(struct seam *s, double reach_radii, struct error *err)
{
    size_t capacity = 0, from = 0;
    double widest = 0.0;
    for (int side = 0; side < 2; side++)
        for (size_t i = 0; i < s->n[side]; i++) widest = fmax(widest, reach_radii * s->end[side][i].radius);
    for (size_t i = 0; i < s->n[0]; i++) {
        const struct end *a = &s->end[0][i];
        while (from < s->n[1] && s->end[1][from].p[2] < a->p[2] - widest) from++;
        for (size_t j = from; j < s->n[1] && s->end[1][j].p[2] <= a->p[2] + widest; j++) {
            const struct end *b = &s->end[1][j];
            double cosine = -(a->t[0] * b->t[0] + a->t[1] * b->t[1] + a->t[2] * b->t[2]), d = distance(s, a, b);
            if (cosine < SAME_COSINE || d > reach_radii * fmin(a->radius, b->radius)) continue;
            status st = add_pair(s, &capacity, (struct pair){d, i, j}, err);
            if (st != STATUS_OK) return st;
        }
    }
    bool *used = calloc(s->n[0] + s->n[1] + 1, sizeof *used);
    if (used == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot measure the seams: out of memory");
    if (s->n_pair > 0) qsort(s->pair, s->n_pair, sizeof *s->pair, by_distance);
    size_t kept = 0;
    for (size_t i = 0; i < s->n_pair; i++) {
        struct pair p = s->pair[i];
        if (used[p.low] || used[s->n[0] + p.high]) continue;
        used[p.low] = used[s->n[0] + p.high] = true;
        s->pair[kept++] = p;
    }
    s->n_pair = kept;
    free(used);
    return STATUS_OK;
}

static void seam_release(struct seam *s)
{
    free(s->end[0]);
    free(s->end[1]);
    free(s->pair);
}

status fiber_seam_measure(const struct fiber_set *f, struct fiber_seam *seam, struct error *err)
{
    status st = STATUS_OK;
    for (int axis = 0; axis < 2 && st == STATUS_OK; axis++) {
        struct seam s = {.f = f, .axis = axis};
        double sum = 0.0;
        st = collect_ends(&s, err);
        if (st == STATUS_OK) st = match(&s, 1.0, err);
        for (size_t i = 0; i < s.n_pair; i++) sum += s.pair[i].distance;
        seam->n_end[axis] = s.n[0] + s.n[1];
        seam->n_continued[axis] = 2 * s.n_pair;
        seam->share[axis] = seam->n_end[axis] > 0 ? (double)seam->n_continued[axis] / (double)seam->n_end[axis] : NAN;
        seam->offset_m[axis] = s.n_pair > 0 ? sum / (double)s.n_pair : NAN;
        seam_release(&s);
    }
    return st;
}

/* Moves an end and the vertices next to it; the shift fades out along the fiber. */
static void shift_end(struct fiber_set *f, const struct end *e, const double shift[3])
{
    size_t first = f->first_vertex[e->i_fiber], n = f->first_vertex[e->i_fiber + 1] - first;
    double along = 0.0, fade = FADE_RADII * e->radius;
    float before[3];
    for (size_t k = 0; k < n; k++) {
        float *p = f->position_m + 3 * (e->last ? first + n - 1 - k : first + k);
        if (k > 0)
            along += sqrt(pow((double)(p[0] - before[0]), 2.0) + pow((double)(p[1] - before[1]), 2.0) +
                          pow((double)(p[2] - before[2]), 2.0));
        if (along >= fade) return;
        memcpy(before, p, sizeof before);
        double weight = 0.5 + 0.5 * cos(M_PI * along / fade);
        for (int a = 0; a < 3; a++) p[a] = (float)((double)p[a] + weight * shift[a]);
    }
}

static void join_pair(struct fiber_set *f, const struct seam *s, const struct end *low, const struct end *high)
{
    int other = 1 - s->axis;
    double tile = f->tile_size_m[s->axis], period = f->tile_size_m[other], half[3] = {0.0}, to_low[3], to_high[3];
    half[other] = high->p[other] - low->p[other];
    half[other] = 0.5 * (half[other] - period * round(half[other] / period));
    half[2] = 0.5 * (high->p[2] - low->p[2]);
    for (int a = 0; a < 3; a++) {
        to_low[a] = half[a];
        to_high[a] = -half[a];
    }
    to_low[s->axis] = -low->p[s->axis];
    to_high[s->axis] = tile - high->p[s->axis];
    shift_end(f, low, to_low);
    shift_end(f, high, to_high);
}

status fiber_seam_join(struct fiber_set *f, size_t *n_joined, struct error *err)
{
    status st = STATUS_OK;
    *n_joined = 0;
    for (int axis = 0; axis < 2 && st == STATUS_OK; axis++) {
        struct seam s = {.f = f, .axis = axis};
        st = collect_ends(&s, err);
        if (st == STATUS_OK) st = match(&s, JOIN_RADII, err);
        for (size_t i = 0; i < s.n_pair && st == STATUS_OK; i++)
            join_pair(f, &s, &s.end[0][s.pair[i].low], &s.end[1][s.pair[i].high]);
        *n_joined += s.n_pair;
        seam_release(&s);
    }
    return st;
}
