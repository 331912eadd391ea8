#include "geometry/fibers/seam/seam_ends.h"

#include "geometry/fibers/seam/assignment.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double SAME_COSINE = 0.7071, ANGLE_RAD = 0.2, RADIUS_SHARE = 0.2;
/* Of an end that may lie on the seam: distance from the face, tangent; of a pair: gap along the axis. */
static const double DEPTH_RADII = 6.0, LEAST_ACROSS = 0.3, GAP_RADII = 2.0;

/* Reach and cells of the histogram of offsets, in radii, and by how many standard deviations of the counts of unrelated
 * ends the fullest cell must stand out. */
enum { VOTE_HALF = 16, N_VOTE = 2 * VOTE_HALF + 1 };
static const double VOTE_CELL = 0.5, VOTE_SIGMAS = 6.0;

static struct seam_end end_of(const struct fiber_set *f, size_t i, bool last, int axis)
{
    const size_t n = f->first_vertex[i + 1] - f->first_vertex[i], back = n > 4 ? 3 : n - 1;
    const size_t at = last ? f->first_vertex[i + 1] - 1 : f->first_vertex[i], inner = last ? at - back : at + back;
    struct seam_end e = {.i_fiber = i, .last = last, .radius = (double)f->radius_m[i]};
    double norm = 0.0;
    for (size_t a = 0; a < 3; a++) {
        e.p[a] = (double)f->position_m[3 * at + a];
        e.t[a] = e.p[a] - (double)f->position_m[3 * inner + a];
        norm += e.t[a] * e.t[a];
    }
    for (int a = 0; a < 3; a++) e.t[a] /= norm > 0.0 ? sqrt(norm) : 1.0;
    const double face = e.t[axis] < 0.0 ? 0.0 : f->tile_size_m[axis], way = (face - e.p[axis]) / e.t[axis];
    e.depth = e.t[axis] < 0.0 ? e.p[axis] : face - e.p[axis];
    e.at[0] = e.p[1 - axis] + way * e.t[1 - axis];
    e.at[1] = e.p[2] + way * e.t[2];
    return e;
}

static int by_height(const void *a, const void *b)
{
    const struct seam_end *x = a, *y = b;
    if (x->at[1] != y->at[1]) return x->at[1] < y->at[1] ? -1 : 1;
    return x->i_fiber != y->i_fiber ? (x->i_fiber > y->i_fiber) - (x->i_fiber < y->i_fiber) : x->last - y->last;
}

status seam_ends_collect(struct seam_ends *s, const struct fiber_set *f, int axis, struct error *err)
{
    const double tile = f->tile_size_m[axis];
    *s = (struct seam_ends){.f = f, .axis = axis};
    for (int side = 0; side < 2; side++) s->end[side] = malloc((2 * f->n_fiber + 1) * sizeof *s->end[side]);
    s->partner = malloc((2 * f->n_fiber + 1) * sizeof *s->partner);
    if (s->end[0] == NULL || s->end[1] == NULL || s->partner == NULL) {
        seam_ends_release(s);
        return error_set(err, STATUS_NO_MEMORY, "cannot measure the seams: out of memory");
    }
    for (size_t i = 0; i < f->n_fiber; i++)
        for (int last = 0; last < 2; last++) {
            const struct seam_end e = end_of(f, i, last == 1, axis);
            if (e.p[axis] <= DEPTH_RADII * e.radius && e.t[axis] < -LEAST_ACROSS)
                s->end[0][s->n[0]++] = e;
            else if (e.p[axis] >= tile - DEPTH_RADII * e.radius && e.t[axis] > LEAST_ACROSS)
                s->end[1][s->n[1]++] = e;
        }
    for (int side = 0; side < 2; side++) qsort(s->end[side], s->n[side], sizeof *s->end[side], by_height);
    for (size_t i = 0; i < s->n[0]; i++) s->partner[i] = SIZE_MAX;
    return STATUS_OK;
}

void seam_ends_release(struct seam_ends *s)
{
    if (s == NULL) return;
    free(s->end[0]);
    free(s->end[1]);
    free(s->partner);
    *s = (struct seam_ends){0};
}

static void offset_between(const struct seam_ends *s, const struct seam_end *low, const struct seam_end *high,
                           double offset_m[2])
{
    const double period = s->f->tile_size_m[1 - s->axis];
    offset_m[0] = high->at[0] - low->at[0];
    offset_m[0] -= period * round(offset_m[0] / period);
    offset_m[1] = high->at[1] - low->at[1];
}

static double cosine_between(const struct seam_end *low, const struct seam_end *high)
{
    return -(low->t[0] * high->t[0] + low->t[1] * high->t[1] + low->t[2] * high->t[2]);
}

static bool may_continue(const struct seam_ends *s, const struct seam_end *low, const struct seam_end *high)
{
    return fabs(low->depth + high->depth) <= GAP_RADII * fmin(low->radius, high->radius) &&
           s->f->group[low->i_fiber] == s->f->group[high->i_fiber] && cosine_between(low, high) >= SAME_COSINE;
}

/* left_m: the offset of the pair without the field's. Infinite beyond the reach. */
static double pair_cost(const struct seam_end *low, const struct seam_end *high, const double left_m[2],
                        enum seam_cost cost, double reach)
{
    const double radius = fmin(low->radius, high->radius), d = hypot(left_m[0], left_m[1]) / radius;
    if (d > reach) return INFINITY;
    if (cost == SEAM_BY_DISTANCE) return d * d;
    const double angle = acos(fmin(1.0, cosine_between(low, high))) / ANGLE_RAD;
    const double thick = (high->radius - low->radius) / (RADIUS_SHARE * 0.5 * (high->radius + low->radius));
    return d * d + angle * angle + thick * thick;
}

static double widest_radius(const struct seam_ends *s)
{
    double widest = 0.0;
    for (int side = 0; side < 2; side++)
        for (size_t i = 0; i < s->n[side]; i++) widest = fmax(widest, s->end[side][i].radius);
    return widest;
}

/* Calls visit for each pair of an end at the low and an end at the high face whose heights differ by at most
 * `window`. */
static status each_pair(const struct seam_ends *s, double window,
                        status (*visit)(void *, size_t, size_t, struct error *), void *context, struct error *err)
{
    size_t from = 0;
    for (size_t i = 0; i < s->n[0]; i++) {
        const double z = s->end[0][i].at[1];
        while (from < s->n[1] && s->end[1][from].at[1] < z - window) from++;
        for (size_t j = from; j < s->n[1] && s->end[1][j].at[1] <= z + window; j++) {
            if (!may_continue(s, &s->end[0][i], &s->end[1][j])) continue;
            const status st = visit(context, i, j, err);
            if (st != STATUS_OK) return st;
        }
    }
    return STATUS_OK;
}

struct pair_list {
    const struct seam_ends *s;
    const struct seam_field *field;
    enum seam_cost cost;
    double reach;
    struct allowed_pair *pair;
    size_t n, capacity;
};

static status add_pair(void *context, size_t low, size_t high, struct error *err)
{
    struct pair_list *l = context;
    const struct seam_end *a = &l->s->end[0][low], *b = &l->s->end[1][high];
    double offset[2], known[2] = {0.0, 0.0};
    offset_between(l->s, a, b, offset);
    if (l->field != NULL) seam_field_at(l->field, a->at, known);
    for (int k = 0; k < 2; k++) offset[k] -= known[k];
    const double cost = pair_cost(a, b, offset, l->cost, l->reach);
    if (!(cost <= l->reach * l->reach)) return STATUS_OK;
    if (l->n == l->capacity) {
        const size_t more = l->capacity == 0 ? 1024 : 2 * l->capacity;
        struct allowed_pair *bigger = realloc(l->pair, more * sizeof *bigger);
        if (bigger == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot measure the seams: out of memory");
        l->pair = bigger;
        l->capacity = more;
    }
    l->pair[l->n++] = (struct allowed_pair){low, high, cost};
    return STATUS_OK;
}

status seam_ends_match(struct seam_ends *s, enum seam_cost cost, double reach, const struct seam_field *field,
                       struct error *err)
{
    struct pair_list l = {.s = s, .field = field, .cost = cost, .reach = reach};
    const double largest = field != NULL ? seam_field_largest(field) : 0.0;
    status st = each_pair(s, reach * widest_radius(s) + largest, add_pair, &l, err);
    if (st == STATUS_OK) st = assignment_find(l.pair, l.n, s->n[0], s->n[1], reach * reach, s->partner, err);
    free(l.pair);
    s->n_pair = 0;
    for (size_t i = 0; i < s->n[0] && st == STATUS_OK; i++) s->n_pair += s->partner[i] != SIZE_MAX;
    return st;
}

size_t seam_ends_count(const struct seam_ends *s)
{
    size_t n = 2 * s->n_pair;
    for (size_t i = 0; i < s->n[0]; i++) n += s->partner[i] == SIZE_MAX && s->end[0][i].depth <= s->end[0][i].radius;
    for (size_t j = 0; j < s->n[1]; j++) n += s->end[1][j].depth <= s->end[1][j].radius;
    for (size_t i = 0; i < s->n[0]; i++)
        if (s->partner[i] != SIZE_MAX) n -= s->end[1][s->partner[i]].depth <= s->end[1][s->partner[i]].radius;
    return n;
}

struct vote {
    const struct seam_ends *s;
    double cell_m;
    double count[N_VOTE][N_VOTE];
};

static status count_vote(void *context, size_t low, size_t high, struct error *err)
{
    (void)err;
    struct vote *v = context;
    double offset[2];
    offset_between(v->s, &v->s->end[0][low], &v->s->end[1][high], offset);
    const double x = offset[0] / v->cell_m + VOTE_HALF + 0.5, z = offset[1] / v->cell_m + VOTE_HALF + 0.5;
    if (x >= 0.0 && z >= 0.0 && x < (double)N_VOTE && z < (double)N_VOTE) v->count[(size_t)z][(size_t)x] += 1.0;
    return STATUS_OK;
}

/* Sum of 3 x 3 cells. */
static double votes_about(const struct vote *v, size_t x, size_t z)
{
    double sum = 0.0;
    for (size_t k = z - 1; k <= z + 1; k++)
        for (size_t i = x - 1; i <= x + 1; i++) sum += v->count[k][i];
    return sum;
}

status seam_ends_common_offset(const struct seam_ends *s, double offset_m[2], struct error *err)
{
    struct vote *v = calloc(1, sizeof *v);
    offset_m[0] = offset_m[1] = 0.0;
    if (v == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot measure the seams: out of memory");
    double radius = 0.0, total = 0.0, best = 0.0;
    for (size_t i = 0; i < s->n[0]; i++) radius += s->end[0][i].radius / (double)s->n[0];
    *v = (struct vote){.s = s, .cell_m = VOTE_CELL * radius};
    status st = radius > 0.0 ? each_pair(s, VOTE_CELL * VOTE_HALF * radius, count_vote, v, err) : STATUS_OK;
    size_t at[2] = {VOTE_HALF, VOTE_HALF};
    for (size_t z = 1; z + 1 < N_VOTE; z++)
        for (size_t x = 1; x + 1 < N_VOTE; x++) {
            const double here = votes_about(v, x, z);
            total += v->count[z][x];
            if (here <= best) continue;
            best = here;
            at[0] = x;
            at[1] = z;
        }
    const double usual = 9.0 * total / (double)((N_VOTE - 2) * (N_VOTE - 2));
    if (best > usual + VOTE_SIGMAS * sqrt(usual + 1.0))
        for (int k = 0; k < 2; k++) offset_m[k] = ((double)at[k] - VOTE_HALF) * v->cell_m;
    free(v);
    return st;
}

void seam_ends_offset(const struct seam_ends *s, size_t low, double offset_m[2])
{
    offset_between(s, &s->end[0][low], &s->end[1][s->partner[low]], offset_m);
}

double seam_ends_angle_rad(const struct seam_ends *s, size_t low)
{
    return acos(fmin(1.0, cosine_between(&s->end[0][low], &s->end[1][s->partner[low]])));
}
