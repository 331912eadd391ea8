#include "geometry/fibers/tiles/tile_ends.h"
#include "geometry/fibers/seam/assignment.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* How near ends that meet as they are lie, in radii, and the cosine between them. */
static const double meet_radii = 0.05, meet_cosine = -0.9;
/* The same of partners at a cut. Fibers that run along a cut leave ends that only later rounds find partners for. */
enum { ROUNDS = 3 };
static const double reach_radii[ROUNDS] = {10.0, 25.0, 60.0}, join_cosine[ROUNDS] = {-0.7, -0.6, -0.4};
static const double angle_rad = 0.2, radius_share = 0.2; /* as SEAM_BY_SHAPE */
/* Length over which a move fades out, in radii and moves, and over the length of the line. */
static const double fade_radii = 8.0, fade_moves = 8.0, fade_lengths = 0.5;

/* Ends by the cells of a grid over the large tile. */
struct grid {
    size_t n[2];
    size_t *head, *next; /* SIZE_MAX: none */
    int round;
};

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static size_t cell_at(const struct tile_ends *e, const struct grid *g, const double p[3], const long by[2])
{
    size_t at[2];
    for (int a = 0; a < 2; a++) {
        const double share = p[a] / e->tile_m[a] - floor(p[a] / e->tile_m[a]);
        const long n = (long)g->n[a], i = (long)fmin(share * (double)n, (double)(n - 1)) + by[a];
        at[a] = (size_t)((i % n + n) % n);
    }
    return at[1] * g->n[0] + at[0];
}

static status make_grid(const struct tile_ends *e, double cell_m, struct grid *g, struct error *err)
{
    for (int a = 0; a < 2; a++) g->n[a] = (size_t)fmin(fmax(floor(e->tile_m[a] / cell_m), 3.0), 2048.0);
    g->head = malloc(g->n[0] * g->n[1] * sizeof *g->head);
    g->next = malloc((e->n + 1) * sizeof *g->next);
    if (g->head == NULL || g->next == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot make a large tile: out of memory");
    memset(g->head, 0xff, g->n[0] * g->n[1] * sizeof *g->head);
    for (size_t i = e->n; i-- > 0;) {
        size_t *head = &g->head[cell_at(e, g, e->end[i].p, (const long[2]){0, 0})];
        g->next[i] = *head;
        *head = i;
    }
    return STATUS_OK;
}

static void free_grid(struct grid *g)
{
    free(g->head);
    free(g->next);
}

static void set_ends(struct tile_ends *e, const struct tile_lines *l, const struct fiber_set *f)
{
    for (size_t i = 0; i < e->n; i++) {
        const size_t line = i / 2, first = l->first[line], last = l->first[line + 1] - 1;
        const struct tile_vertex *v = &l->vertex[i % 2 == 0 ? first : last], *inner = i % 2 == 0 ? v + 1 : v - 1;
        struct tile_end *to = &e->end[i];
        double length = 0.0;
        for (int a = 0; a < 3; a++) {
            to->p[a] = v->p[a];
            to->t[a] = v->p[a] - inner->p[a];
            length += to->t[a] * to->t[a];
        }
        for (int a = 0; a < 3 && length > 0.0; a++) to->t[a] /= sqrt(length);
        to->radius = (double)f->radius_m[l->source[line]];
        to->group = f->group[l->source[line]];
        to->is_cut = l->is_cut[line][i % 2];
        e->partner[i] = SIZE_MAX;
    }
}

void tile_ends_between(const struct tile_ends *e, size_t i, size_t k, double d[3])
{
    for (int a = 0; a < 3; a++) d[a] = e->end[k].p[a] - e->end[i].p[a];
    for (int a = 0; a < 2; a++) d[a] -= e->tile_m[a] * round(d[a] / e->tile_m[a]);
}

/* Pairs the ends that lie at one place already: at faces of the tile, and where a cut has the same on both sides. */
static void meet(struct tile_ends *e, const struct grid *g)
{
    for (size_t i = 0; i < e->n; i++)
        for (long c = 0; c < 9 && e->partner[i] == SIZE_MAX; c++) {
            const long by[2] = {c % 3 - 1, c / 3 - 1};
            for (size_t k = g->head[cell_at(e, g, e->end[i].p, by)]; k != SIZE_MAX; k = g->next[k]) {
                double d[3];
                tile_ends_between(e, i, k, d);
                if (k == i || e->partner[k] != SIZE_MAX || e->end[i].group != e->end[k].group ||
                    sqrt(dot(d, d)) > meet_radii * e->end[i].radius || dot(e->end[i].t, e->end[k].t) > meet_cosine)
                    continue;
                e->partner[i] = k;
                e->partner[k] = i;
                break;
            }
        }
}

/* Opposite directions lie on different sides of a plane that yarns of neither direction lie in. */
static bool is_ahead(const struct tile_end *e) { return e->t[0] * 0.89 + e->t[1] * 0.45 + e->t[2] * 0.1 > 0.0; }

/* Cost of a pair; negative: it is not allowed. */
static double cost_of(const struct tile_ends *e, int round, size_t i, size_t k)
{
    const struct tile_end *a = &e->end[i], *b = &e->end[k];
    const double cosine = dot(a->t, b->t), radius = 0.5 * (a->radius + b->radius);
    double d[3];
    if (a->group != b->group || i / 2 == k / 2 || cosine > join_cosine[round]) return -1.0;
    tile_ends_between(e, i, k, d);
    const double distance = sqrt(dot(d, d)) / radius, angle = acos(fmin(fmax(-cosine, -1.0), 1.0)) / angle_rad,
                 thicker = (a->radius - b->radius) / (radius_share * radius);
    const double cost = distance * distance + angle * angle + thicker * thicker;
    const double reach = reach_radii[round];
    return distance < reach && cost < 2.0 * reach * reach ? cost : -1.0;
}

struct pairs {
    struct allowed_pair *pair;
    size_t n, room;
};

static status add_pair(struct pairs *p, struct allowed_pair pair, struct error *err)
{
    if (p->n == p->room) {
        struct allowed_pair *more = realloc(p->pair, (2 * p->room + 1024) * sizeof *more);
        if (more == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot make a large tile: out of memory");
        p->pair = more;
        p->room = 2 * p->room + 1024;
    }
    p->pair[p->n++] = pair;
    return STATUS_OK;
}

/* Allowed pairs of the cut ends without a partner: row and column number ends that point ahead and back. */
static status list_pairs(const struct tile_ends *e, const struct grid *g, const size_t *number, struct pairs *p,
                         struct error *err)
{
    for (size_t i = 0; i < e->n; i++) {
        if (number[i] == SIZE_MAX || !is_ahead(&e->end[i])) continue;
        for (long c = 0; c < 9; c++) {
            const long by[2] = {c % 3 - 1, c / 3 - 1};
            for (size_t k = g->head[cell_at(e, g, e->end[i].p, by)]; k != SIZE_MAX; k = g->next[k]) {
                if (number[k] == SIZE_MAX || is_ahead(&e->end[k])) continue;
                const double cost = cost_of(e, g->round, i, k);
                if (cost < 0.0) continue;
                status s = add_pair(p, (struct allowed_pair){number[i], number[k], cost}, err);
                if (s != STATUS_OK) return s;
            }
        }
    }
    return STATUS_OK;
}

/* One round. number, row_end, column_end: room for all ends. */
static status join_cut_ends(struct tile_ends *e, const struct grid *g, size_t *number, size_t *row_end,
                            size_t *column_end, struct error *err)
{
    size_t n[2] = {0, 0};
    struct pairs p = {0};
    for (size_t i = 0; i < e->n; i++) {
        number[i] = SIZE_MAX;
        if (!e->end[i].is_cut || e->partner[i] != SIZE_MAX) continue;
        if (is_ahead(&e->end[i]))
            row_end[number[i] = n[0]++] = i;
        else
            column_end[number[i] = n[1]++] = i;
    }
    status s = list_pairs(e, g, number, &p, err);
    size_t *partner = malloc((n[0] + 1) * sizeof *partner);
    if (s == STATUS_OK && partner == NULL)
        s = error_set(err, STATUS_NO_MEMORY, "cannot make a large tile: out of memory");
    if (s == STATUS_OK)
        s = assignment_find(p.pair, p.n, n[0], n[1], 2.0 * pow(reach_radii[g->round], 2.0), partner, err);
    for (size_t i = 0; i < n[0] && s == STATUS_OK; i++) {
        if (partner[i] == SIZE_MAX) continue;
        e->partner[row_end[i]] = column_end[partner[i]];
        e->partner[column_end[partner[i]]] = row_end[i];
    }
    free(partner);
    free(p.pair);
    return s;
}

status tile_ends_make(struct tile_ends *e, const struct tile_lines *l, const struct fiber_set *f,
                      const double tile_m[2], struct fiber_tiles *tiles, struct error *err)
{
    double radius = 0.0;
    *e = (struct tile_ends){.n = 2 * l->n_line, .tile_m = {tile_m[0], tile_m[1]}};
    e->end = malloc((e->n + 1) * sizeof *e->end);
    e->partner = malloc((e->n + 1) * sizeof *e->partner);
    size_t *scratch = malloc(3 * (e->n + 1) * sizeof *scratch);
    status s = e->end != NULL && e->partner != NULL && scratch != NULL
                   ? STATUS_OK
                   : error_set(err, STATUS_NO_MEMORY, "cannot make a large tile: out of memory");
    if (s == STATUS_OK) set_ends(e, l, f);
    for (size_t i = 0; i < e->n && s == STATUS_OK; i++) radius = fmax(radius, e->end[i].radius);
    for (int round = 0; round < ROUNDS && s == STATUS_OK; round++) {
        struct grid g = {.round = round};
        s = make_grid(e, reach_radii[round] * radius, &g, err);
        if (s == STATUS_OK && round == 0) {
            meet(e, &g);
            for (size_t i = 0; i < e->n; i++) tiles->n_cut_end += e->end[i].is_cut && e->partner[i] == SIZE_MAX;
        }
        if (s == STATUS_OK) s = join_cut_ends(e, &g, scratch, scratch + e->n, scratch + 2 * e->n, err);
        free_grid(&g);
    }
    for (size_t i = 0; i < e->n && s == STATUS_OK; i++) tiles->n_free += e->end[i].is_cut && e->partner[i] == SIZE_MAX;
    free(scratch);
    return s;
}

void tile_ends_release(struct tile_ends *e)
{
    free(e->end);
    free(e->partner);
    memset(e, 0, sizeof *e);
}

/* Moves an end by shift, and turns it by turn, and the vertices next to it. */
static void move_end(struct tile_lines *l, size_t i_end, double radius, const double shift[3], const double turn[3])
{
    const size_t line = i_end / 2, first = l->first[line], n = l->first[line + 1] - first;
    double length = 0.0, along = 0.0, before[3] = {0.0, 0.0, 0.0};
    for (size_t k = first; k + 1 < first + n; k++) {
        double d[3];
        for (int a = 0; a < 3; a++) d[a] = l->vertex[k + 1].p[a] - l->vertex[k].p[a];
        length += sqrt(dot(d, d));
    }
    const double fade = fmin(fmax(fade_radii * radius, fade_moves * sqrt(dot(shift, shift))), fade_lengths * length);
    for (size_t k = 0; k < n; k++) {
        double *p = l->vertex[i_end % 2 == 0 ? first + k : first + n - 1 - k].p, d[3];
        for (int a = 0; a < 3; a++) d[a] = p[a] - before[a];
        if (k > 0) along += sqrt(dot(d, d));
        if (along >= fade) return;
        memcpy(before, p, sizeof before);
        const double u = along / fade, of_shift = 1.0 - u * u * (3.0 - 2.0 * u),
                     of_turn = along * (1.0 - u) * (1.0 - u);
        for (int a = 0; a < 3; a++) p[a] += of_shift * shift[a] + of_turn * turn[a];
    }
}

void tile_ends_join(const struct tile_ends *e, struct tile_lines *l, struct fiber_tiles *tiles)
{
    size_t n = 0;
    double sum = 0.0;
    for (size_t i = 0; i < e->n; i++) {
        const size_t k = e->partner[i];
        if (k == SIZE_MAX || k < i) continue;
        double d[3], mean[3], shift[2][3], turn[2][3];
        tile_ends_between(e, i, k, d);
        for (int a = 0; a < 3; a++) mean[a] = e->end[i].t[a] - e->end[k].t[a];
        const double length = sqrt(dot(mean, mean));
        for (int a = 0; a < 3; a++) {
            mean[a] /= length;
            shift[0][a] = 0.5 * d[a];
            shift[1][a] = -0.5 * d[a];
            /* inwards a line runs against its tangent */
            turn[0][a] = e->end[i].t[a] - mean[a];
            turn[1][a] = e->end[k].t[a] + mean[a];
        }
        move_end(l, i, e->end[i].radius, shift[0], turn[0]);
        move_end(l, k, e->end[k].radius, shift[1], turn[1]);
        if (!e->end[i].is_cut || sqrt(dot(d, d)) <= meet_radii * e->end[i].radius) continue;
        sum += 0.5 * sqrt(dot(d, d));
        n++;
    }
    tiles->move_m = n > 0 ? sum / (double)n : NAN;
}
