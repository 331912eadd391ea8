/* Pushes fibers apart. Overlapping nodes of different fibers each move by half of the overlap, across their fibers.
 * Then the displacements are smoothed along each strand (not the positions, so crimp and twist stay), and bends that
 * would break a fiber are straightened. These are Jacobi rounds: all nodes are evaluated before any node moves. */
#include "geometry/cloth/strand_grid.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* N_UNBEND: steps per round. */
enum { NODES_PER_TASK = 2048, N_UNBEND = 6 };

/* Share of its last step by which a node moves again (heavy-ball momentum). A stack of fibers then separates in a
 * sixth of the rounds. */
static const double momentum = 0.8;
/* The surface of a bent fiber is strained by its radius over the radius of the bend. Textile fibers break at 3 %
 * (flax) to about 40 % (wool, polyester), so no fiber bends more sharply than this, which is a radius of curvature
 * of two diameters. */
static const double MAX_STRAIN = 0.25;
/* share of a correction applied at once, because the corrections of neighbouring bends add up */
static const double UNBEND = 0.5;

struct relax {
    struct strand_set *s;
    enum strand_rule rule;
    uint32_t *strand_of;           /* node -> strand */
    double (*move)[3], (*step)[3]; /* wanted by the overlaps, and taken last */
    double *n_contact;             /* of a node, as its rule counts them */
    double *depth;                 /* deepest overlap of a node, over the sum of radii */
    double per_tile[2];
    struct strand_grid grid;
};

static void relax_release(struct relax *r)
{
    free(r->strand_of);
    free(r->move);
    free(r->step);
    free(r->n_contact);
    free(r->depth);
    strand_grid_release(&r->grid);
}

static status relax_init(struct relax *r, struct strand_set *s, enum strand_rule rule, struct error *err)
{
    *r = (struct relax){.s = s, .rule = rule, .per_tile = {1.0 / s->tile_m[0], 1.0 / s->tile_m[1]}};
    r->strand_of = calloc(s->n_node, sizeof *r->strand_of);
    r->move = calloc(s->n_node, sizeof *r->move);
    r->step = calloc(s->n_node, sizeof *r->step);
    r->n_contact = calloc(s->n_node, sizeof *r->n_contact);
    r->depth = calloc(s->n_node, sizeof *r->depth);
    if (!r->strand_of || !r->move || !r->step || !r->n_contact || !r->depth)
        return error_set(err, STATUS_NO_MEMORY, "cannot make the fibers: out of memory");
    for (size_t i = 0; i < s->n_strand; i++)
        for (size_t k = 0; k < s->strand[i].n; k++) r->strand_of[s->strand[i].first + k] = (uint32_t)i;
    return strand_grid_init(&r->grid, s, err);
}

/* Finds node k + step along its strand. Returns false beyond an open end. */
static bool neighbour(const struct strand *t, size_t k, long step, double (*from)[3], double out[3])
{
    long i = (long)(k - t->first) + step, n = (long)t->n;
    long turn = i < 0 ? -1 : i >= n ? 1 : 0;
    if (turn != 0 && t->n_period == 0) return false;
    const double *q = from[t->first + (size_t)(i - turn * n)];
    out[0] = q[0] + (double)turn * t->shift[0];
    out[1] = q[1] + (double)turn * t->shift[1];
    out[2] = q[2];
    return true;
}

/* Nodes that are near each other along one strand belong to one fiber and do not push each other apart. */
static bool same_fiber(const struct strand_set *s, const struct grid_node *a, const struct grid_node *b)
{
    if (a->strand != b->strand) return false;
    const struct strand *t = &s->strand[a->strand];
    size_t gap = a->node > b->node ? a->node - b->node : b->node - a->node;
    if (t->n_period > 0 && t->n - gap < gap) gap = t->n - gap;
    return gap < 8; /* nodes are a radius apart: longer than a half circle of radius 2 r */
}

struct push {
    double sum[3], depth;
    double n; /* contacts; STRAND_SMOOTH: each counts by its depth */
};

/* Adds one contact without a step at first touch, and without a sudden turn when centres pass each other. */
static void push_smoothly(struct push *push, const double d[3], double distance, double want)
{
    static const double full = 0.1, blunt = 0.2; /* of the sum of radii */
    double depth = want - distance, share = fmin(1.0, depth / (full * want));
    double length = sqrt(distance * distance + blunt * blunt * want * want);
    for (int a = 0; a < 3; a++) push->sum[a] += 0.5 * depth * d[a] / length;
    push->depth = fmax(push->depth, depth / want);
    push->n += share * share * (3.0 - 2.0 * share);
}

/* Vector from node j to node i, to the nearest one of all tiles; returns its squared length. */
static inline double apart(const struct relax *r, const struct grid_node *i, const struct grid_node *j, double d[3])
{
    for (int a = 0; a < 3; a++) {
        d[a] = i->p[a] - j->p[a];
        if (a < 2) d[a] -= r->s->tile_m[a] * rint(d[a] * r->per_tile[a]);
    }
    return d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
}

static void push_from(const struct relax *r, const struct grid_node *i, const struct grid_node *j, struct push *push)
{
    double want = i->radius_m + j->radius_m, d[3], d2 = apart(r, i, j, d);
    if (same_fiber(r->s, i, j)) return;
    double distance = sqrt(d2), depth = want - distance;
    if (r->rule == STRAND_SMOOTH) {
        push_smoothly(push, d, distance, want);
        return;
    }
    if (distance < 1e-9 * want) { /* on top of each other: the lower number goes down */
        d[0] = d[1] = 0.0;
        d[2] = i->node < j->node ? -1.0 : 1.0;
        distance = 1.0;
    }
    for (int a = 0; a < 3; a++) push->sum[a] += 0.5 * depth * d[a] / distance;
    push->depth = fmax(push->depth, depth / want);
    push->n += 1.0;
}

/* run: the cells around that of the node. The nodes that are near enough are found first, in a loop that does little
 * else, because most are not. */
static void look_from(struct relax *r, const struct grid_node *from, const struct grid_run *run, size_t n_run)
{
    enum { MOST_NEAR = 64 };
    const struct grid_node *near[MOST_NEAR];
    const size_t i = from->node;
    size_t n_near = 0;
    struct push push = {{0.0, 0.0, 0.0}, 0.0, 0.0};
    for (size_t c = 0; c < n_run; c++)
        for (const struct grid_node *j = r->grid.sorted + run[c].from; j < r->grid.sorted + run[c].to; j++) {
            double d[3], want = from->radius_m + j->radius_m;
            near[n_near] = j;
            n_near += apart(r, from, j, d) < want * want;
            if (n_near < MOST_NEAR) continue;
            for (size_t k = 0; k < n_near; k++) push_from(r, from, near[k], &push);
            n_near = 0;
        }
    for (size_t k = 0; k < n_near; k++) push_from(r, from, near[k], &push);
    memcpy(r->move[i], push.sum, sizeof push.sum);
    r->n_contact[i] = push.n;
    r->depth[i] = push.depth;
}

/* Looks from nodes in the order of their cells, so that neighbours of one node are those of the next. */
static void look(void *context, size_t i_task, size_t i_thread)
{
    struct relax *r = context;
    const struct strand_grid *g = &r->grid;
    size_t end = (i_task + 1) * NODES_PER_TASK < r->s->n_node ? (i_task + 1) * NODES_PER_TASK : r->s->n_node, n_run = 0;
    struct grid_run run[GRID_MAX_RUN];
    uint32_t cell = UINT32_MAX;
    (void)i_thread;
    for (size_t k = i_task * NODES_PER_TASK; k < end; k++) {
        const struct grid_node *from = &g->sorted[k];
        if (g->cell_of[from->node] != cell) n_run = strand_grid_around(g, cell = g->cell_of[from->node], run);
        look_from(r, from, run, n_run);
    }
}

/* Makes the moves of the sums of contacts: their means, without the part along the fiber, which would only shuffle
 * nodes. */
static void settle_at(struct relax *r, size_t i)
{
    const struct strand_set *s = r->s;
    const struct strand *t = &s->strand[r->strand_of[i]];
    double before[3], after[3], along[3], length2 = 0.0, dot = 0.0, n = r->n_contact[i];
    if (n == 0.0) { /* nothing touches it */
        for (int a = 0; a < 3; a++) r->move[i][a] = 0.0;
        return;
    }
    if (!neighbour(t, i, -1, s->p, before)) memcpy(before, s->p[i], sizeof before);
    if (!neighbour(t, i, 1, s->p, after)) memcpy(after, s->p[i], sizeof after);
    for (int a = 0; a < 3; a++) {
        along[a] = after[a] - before[a];
        length2 += along[a] * along[a];
        dot += along[a] * r->move[i][a];
    }
    for (int a = 0; a < 3; a++) r->move[i][a] = (r->move[i][a] - dot * along[a] / length2) / (0.5 * n + 0.5);
}

static void settle(void *context, size_t i_task, size_t i_thread)
{
    struct relax *r = context;
    size_t end = (i_task + 1) * NODES_PER_TASK < r->s->n_node ? (i_task + 1) * NODES_PER_TASK : r->s->n_node;
    (void)i_thread;
    for (size_t i = i_task * NODES_PER_TASK; i < end; i++) settle_at(r, i);
}

/* p = start + displacement, smoothed once with weights 1/4 1/2 1/4 blended by `amount`. */
static void smooth(struct relax *r, double amount)
{
    struct strand_set *s = r->s;
    for (size_t k = 0; k < s->n_node; k++)
        for (int a = 0; a < 3; a++) r->move[k][a] = s->p[k][a] - s->start[k][a];
    for (size_t i = 0; i < s->n_strand; i++) {
        const struct strand *t = &s->strand[i];
        for (size_t k = 0; k < t->n; k++) {
            bool first = k == 0, last = k + 1 == t->n;
            size_t before = !first            ? k - 1
                            : t->n_period > 0 ? t->n - 1
                                              : k,
                   after = !last             ? k + 1
                           : t->n_period > 0 ? 0
                                             : k;
            for (int a = 0; a < 3; a++) {
                double own = r->move[t->first + k][a];
                double mean = 0.5 * own + 0.25 * (r->move[t->first + before][a] + r->move[t->first + after][a]);
                s->p[t->first + k][a] = s->start[t->first + k][a] + own + amount * (mean - own);
            }
        }
    }
}

/* The bend at the middle one of three nodes: the second difference of the positions. Returns its square and that of
 * half of the chord. */
static double bend_of(const double before[3], const double at[3], const double after[3], double bend[3], double *chord2)
{
    double bend2 = 0.0;
    *chord2 = 0.0;
    for (int a = 0; a < 3; a++) {
        bend[a] = before[a] - 2.0 * at[a] + after[a];
        bend2 += bend[a] * bend[a];
        *chord2 += 0.25 * (after[a] - before[a]) * (after[a] - before[a]);
    }
    return bend2;
}

/* Adds what the bend at the middle one of three nodes wants: where a strand bends more sharply than fibers can, the
 * three move towards a straight line until the bend is allowed. weight: of the node that is moved. */
static inline void add_unbend(const double before[3], const double at[3], const double after[3], double most_per_chord2,
                              double weight, double sum[3])
{
    double bend[3], chord2, bend2 = bend_of(before, at, after, bend, &chord2), most = most_per_chord2 * chord2;
    if (!(bend2 > most * most)) return;
    double share = UNBEND * weight / 6.0 * (1.0 - most / sqrt(bend2));
    for (int a = 0; a < 3; a++) sum[a] += share * bend[a];
}

/* The same where a strand ends, or meets itself. */
static void unbend_end(const struct relax *r, const struct strand *t, size_t i, double most, double sum[3])
{
    double q[5][3] = {{0.0}}; /* nodes i - 2 to i + 2 */
    bool there[5];
    for (long k = 0; k < 5; k++) there[k] = neighbour(t, i, k - 2, r->s->p, q[k]);
    for (int k = 1; k <= 3; k++)
        if (there[k - 1] && there[k] && there[k + 1])
            add_unbend(q[k - 1], q[k], q[k + 1], most, k == 2 ? 2.0 : -1.0, sum);
}

/* Computes the sum of the moves of node i for the bends at node i and its two neighbours. */
static void unbend_at(struct relax *r, size_t i)
{
    const struct strand *t = &r->s->strand[r->strand_of[i]];
    const double most = MAX_STRAIN / t->radius_m;
    const size_t from_start = i - t->first;
    double sum[3] = {0.0, 0.0, 0.0}, (*q)[3] = r->s->p + i;
    if (from_start >= 2 && from_start + 2 < t->n) {
        add_unbend(q[-2], q[-1], q[0], most, -1.0, sum);
        add_unbend(q[-1], q[0], q[1], most, 2.0, sum);
        add_unbend(q[0], q[1], q[2], most, -1.0, sum);
    } else {
        unbend_end(r, t, i, most, sum);
    }
    memcpy(r->move[i], sum, sizeof sum);
}

static void unbend(void *context, size_t i_task, size_t i_thread)
{
    struct relax *r = context;
    size_t end = (i_task + 1) * NODES_PER_TASK < r->s->n_node ? (i_task + 1) * NODES_PER_TASK : r->s->n_node;
    (void)i_thread;
    for (size_t i = i_task * NODES_PER_TASK; i < end; i++) unbend_at(r, i);
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Strain that 95 % of the nodes stay below. Overwrites the depths. */
static double strain_p95(struct relax *r)
{
    size_t n = 0;
    for (size_t i = 0; i < r->s->n_node; i++) {
        const struct strand *t = &r->s->strand[r->strand_of[i]];
        double before[3], after[3], bend[3], chord2;
        if (!neighbour(t, i, -1, r->s->p, before) || !neighbour(t, i, 1, r->s->p, after)) continue;
        double bend2 = bend_of(before, r->s->p[i], after, bend, &chord2);
        if (chord2 > 0.0) r->depth[n++] = t->radius_m * sqrt(bend2) / chord2;
    }
    qsort(r->depth, n, sizeof *r->depth, ascending);
    return n > 0 ? r->depth[(size_t)(0.95 * (double)(n - 1))] : 0.0;
}

status strand_relax(struct strand_set *s, const struct strand_relax_option *o, struct thread_pool *pool,
                    const struct progress *progress, struct strand_fit *fit, struct error *err)
{
    const size_t n_round = o->n_round;
    struct relax r;
    status st = STATUS_OK;
    memcpy(s->p, s->start, s->n_node * sizeof *s->p);
    st = relax_init(&r, s, o->rule, err);
    if (st != STATUS_OK) goto out;
    size_t n_task = (s->n_node + NODES_PER_TASK - 1) / NODES_PER_TASK;
    const struct progress quiet = progress_silent(progress);
    for (size_t i_round = 0; i_round <= n_round; i_round++) {
        strand_grid_sort(&r.grid, s, r.strand_of);
        st = thread_pool_run(pool, n_task, look, &r, &quiet);
        if (st != STATUS_OK) goto out;
        if (i_round == n_round) break; /* the last look only measures */
        st = thread_pool_run(pool, n_task, settle, &r, &quiet);
        if (st != STATUS_OK) goto out;
        for (size_t k = 0; k < s->n_node; k++)
            for (int a = 0; a < 3; a++) {
                r.step[k][a] = r.move[k][a] + momentum * r.step[k][a];
                s->p[k][a] += r.step[k][a];
            }
        /* smoothing decreases, so that the last rounds only separate */
        smooth(&r, 1.0 - 0.9 * (double)i_round / (double)n_round);
        for (int k = 0; k < N_UNBEND && st == STATUS_OK; k++) {
            st = thread_pool_run(pool, n_task, unbend, &r, &quiet);
            for (size_t i = 0; i < s->n_node && st == STATUS_OK; i++)
                for (int a = 0; a < 3; a++) s->p[i][a] += r.move[i][a];
        }
        if (st != STATUS_OK) goto out;
        progress_report(progress, (double)(i_round + 1) / (double)n_round);
    }
    fit->overlap_mean = fit->overlap_max = 0.0;
    for (size_t k = 0; k < s->n_node; k++) {
        fit->overlap_mean += r.depth[k] / (double)s->n_node;
        fit->overlap_max = fmax(fit->overlap_max, r.depth[k]);
    }
    fit->strain_p95 = strain_p95(&r);
out:
    relax_release(&r);
    return st == STATUS_CANCELLED ? error_set(err, st, "cancelled while making the fibers") : st;
}
