/* Pushes fibers apart. Overlapping nodes of different fibers each move by half of the overlap, across their fibers.
 * Then the displacements are smoothed along each strand (not the positions, so crimp and twist stay), and bends that
 * would break a fiber are straightened. These are Jacobi rounds: all nodes are evaluated before any node moves. */
#include "geometry/cloth/strand.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* N_UNBEND: steps per round. MAX_CELLS limits the memory of the grid that finds neighbours. */
enum { NODES_PER_TASK = 2048, N_UNBEND = 6, MAX_CELLS = 1 << 26 };

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
    double *depth;                 /* deepest overlap of a node, over the sum of radii */
    double r_max, per_tile[2];
    size_t n_cell[3];
    double cell_m[3], z_low_m;
    size_t *cell_first; /* counting sort by cell */
    uint32_t *cell_node;
    uint32_t *cell_of;
};

static void relax_release(struct relax *r)
{
    free(r->strand_of);
    free(r->move);
    free(r->step);
    free(r->depth);
    free(r->cell_first);
    free(r->cell_node);
    free(r->cell_of);
}

static size_t wrap_cell(double x, double cell_m, size_t n_cell)
{
    double c = fmod(floor(x / cell_m), (double)n_cell);
    if (c < 0.0) c += (double)n_cell;
    return (size_t)c < n_cell ? (size_t)c : n_cell - 1;
}

static size_t clamp_cell(double x, double cell_m, size_t n_cell)
{
    double c = floor(x / cell_m);
    return c < 0.0 ? 0 : c >= (double)n_cell ? n_cell - 1 : (size_t)c;
}

/* Divides the space into cells at least a diameter wide; thin fibers in a high pile get wider ones. */
static void choose_cells(struct relax *r, const double extent_m[3])
{
    double edge_m = 2.0 * r->r_max, n_cell[3];
    do {
        for (int a = 0; a < 3; a++) n_cell[a] = fmax(1.0, floor(extent_m[a] / edge_m));
        edge_m *= 1.25;
    } while (n_cell[0] * n_cell[1] * n_cell[2] > MAX_CELLS);
    for (int a = 0; a < 3; a++) {
        r->n_cell[a] = (size_t)n_cell[a];
        r->cell_m[a] = extent_m[a] / n_cell[a];
    }
}

static status relax_init(struct relax *r, struct strand_set *s, enum strand_rule rule, struct error *err)
{
    *r = (struct relax){.s = s, .rule = rule, .per_tile = {1.0 / s->tile_m[0], 1.0 / s->tile_m[1]}};
    double low = INFINITY, high = -INFINITY;
    for (size_t i = 0; i < s->n_strand; i++) r->r_max = fmax(r->r_max, s->strand[i].radius_m);
    for (size_t k = 0; k < s->n_node; k++) {
        low = fmin(low, s->start[k][2]);
        high = fmax(high, s->start[k][2]);
    }
    r->z_low_m = low - 4.0 * r->r_max;
    choose_cells(r, (const double[3]){s->tile_m[0], s->tile_m[1], high - low + 8.0 * r->r_max});
    size_t n_cell = r->n_cell[0] * r->n_cell[1] * r->n_cell[2];
    r->strand_of = calloc(s->n_node, sizeof *r->strand_of);
    r->move = calloc(s->n_node, sizeof *r->move);
    r->step = calloc(s->n_node, sizeof *r->step);
    r->depth = calloc(s->n_node, sizeof *r->depth);
    r->cell_first = calloc(n_cell + 2, sizeof *r->cell_first);
    r->cell_node = calloc(s->n_node, sizeof *r->cell_node);
    r->cell_of = calloc(s->n_node, sizeof *r->cell_of);
    if (!r->strand_of || !r->move || !r->step || !r->depth || !r->cell_first || !r->cell_node || !r->cell_of)
        return error_set(err, STATUS_NO_MEMORY, "cannot make the fibers: out of memory");
    for (size_t i = 0; i < s->n_strand; i++)
        for (size_t k = 0; k < s->strand[i].n; k++) r->strand_of[s->strand[i].first + k] = (uint32_t)i;
    return STATUS_OK;
}

static void sort_into_cells(struct relax *r)
{
    const struct strand_set *s = r->s;
    size_t n_cell = r->n_cell[0] * r->n_cell[1] * r->n_cell[2];
    memset(r->cell_first, 0, (n_cell + 2) * sizeof *r->cell_first);
    for (size_t k = 0; k < s->n_node; k++) {
        size_t c = (clamp_cell(s->p[k][2] - r->z_low_m, r->cell_m[2], r->n_cell[2]) * r->n_cell[1] +
                    wrap_cell(s->p[k][1], r->cell_m[1], r->n_cell[1])) *
                       r->n_cell[0] +
                   wrap_cell(s->p[k][0], r->cell_m[0], r->n_cell[0]);
        r->cell_of[k] = (uint32_t)c;
        r->cell_first[c + 2]++;
    }
    for (size_t c = 0; c < n_cell; c++) r->cell_first[c + 2] += r->cell_first[c + 1];
    for (size_t k = 0; k < s->n_node; k++) r->cell_node[r->cell_first[r->cell_of[k] + 1]++] = (uint32_t)k;
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
static bool same_fiber(const struct strand_set *s, const uint32_t *strand_of, size_t i, size_t j)
{
    if (strand_of[i] != strand_of[j]) return false;
    const struct strand *t = &s->strand[strand_of[i]];
    size_t gap = i > j ? i - j : j - i;
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

static void push_from(const struct relax *r, size_t i, size_t j, struct push *push)
{
    const struct strand_set *s = r->s;
    double want = s->strand[r->strand_of[i]].radius_m + s->strand[r->strand_of[j]].radius_m, d[3];
    for (int a = 0; a < 3; a++) {
        d[a] = s->p[i][a] - s->p[j][a];
        if (a < 2) d[a] -= s->tile_m[a] * rint(d[a] * r->per_tile[a]);
    }
    double d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    if (d2 >= want * want || same_fiber(s, r->strand_of, i, j)) return;
    double distance = sqrt(d2), depth = want - distance;
    if (r->rule == STRAND_SMOOTH) {
        push_smoothly(push, d, distance, want);
        return;
    }
    if (distance < 1e-9 * want) { /* on top of each other: the lower number goes down */
        d[0] = d[1] = 0.0;
        d[2] = i < j ? -1.0 : 1.0;
        distance = 1.0;
    }
    for (int a = 0; a < 3; a++) push->sum[a] += 0.5 * depth * d[a] / distance;
    push->depth = fmax(push->depth, depth / want);
    push->n += 1.0;
}

static void push_from_cell_row(const struct relax *r, size_t i, size_t z, size_t y, size_t at_x, struct push *push)
{
    size_t reach = r->n_cell[0] >= 3 ? 3 : r->n_cell[0]; /* on a very small tile the neighbours would repeat */
    for (size_t dx = 0; dx < reach; dx++) {
        size_t x = (at_x + r->n_cell[0] + dx - 1) % r->n_cell[0];
        size_t cell = (z * r->n_cell[1] + y) * r->n_cell[0] + x;
        for (size_t k = r->cell_first[cell]; k < r->cell_first[cell + 1]; k++) push_from(r, i, r->cell_node[k], push);
    }
}

static void look_from(struct relax *r, size_t i)
{
    const struct strand_set *s = r->s;
    struct push push = {{0.0, 0.0, 0.0}, 0.0, 0.0};
    size_t c = r->cell_of[i],
           at[3] = {c % r->n_cell[0], c / r->n_cell[0] % r->n_cell[1], c / (r->n_cell[0] * r->n_cell[1])};
    size_t reach = r->n_cell[1] >= 3 ? 3 : r->n_cell[1];
    size_t z_from = at[2] > 0 ? at[2] - 1 : 0, z_to = at[2] + 1 < r->n_cell[2] ? at[2] + 1 : at[2];
    for (size_t z = z_from; z <= z_to; z++)
        for (size_t dy = 0; dy < reach; dy++)
            push_from_cell_row(r, i, z, (at[1] + r->n_cell[1] + dy - 1) % r->n_cell[1], at[0], &push);
    const struct strand *t = &s->strand[r->strand_of[i]];
    double before[3], after[3], along[3], length2 = 0.0, dot = 0.0;
    if (!neighbour(t, i, -1, s->p, before)) memcpy(before, s->p[i], sizeof before);
    if (!neighbour(t, i, 1, s->p, after)) memcpy(after, s->p[i], sizeof after);
    for (int a = 0; a < 3; a++) {
        along[a] = after[a] - before[a];
        length2 += along[a] * along[a];
        dot += along[a] * push.sum[a];
    }
    for (int a = 0; a < 3; a++) /* the part along the fiber would only shuffle nodes */
        r->move[i][a] = push.n == 0.0 ? 0.0 : (push.sum[a] - dot * along[a] / length2) / (0.5 * push.n + 0.5);
    r->depth[i] = push.depth;
}

static void look(void *context, size_t i_task, size_t i_thread)
{
    struct relax *r = context;
    size_t end = (i_task + 1) * NODES_PER_TASK < r->s->n_node ? (i_task + 1) * NODES_PER_TASK : r->s->n_node;
    (void)i_thread;
    for (size_t i = i_task * NODES_PER_TASK; i < end; i++) look_from(r, i);
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

/* Computes the bend at node i + step of a strand: the second difference of the positions, and half of the squared
 * chord. Returns false beyond open ends. */
static bool bend_at(const struct strand_set *s, const struct strand *t, size_t i, long step, double bend[3],
                    double *bend_m, double *chord2)
{
    double before[3], at[3], after[3], bend2 = 0.0;
    if (!neighbour(t, i, step - 1, s->p, before) || !neighbour(t, i, step, s->p, at) ||
        !neighbour(t, i, step + 1, s->p, after))
        return false;
    *chord2 = 0.0;
    for (int a = 0; a < 3; a++) {
        bend[a] = before[a] - 2.0 * at[a] + after[a];
        bend2 += bend[a] * bend[a];
        *chord2 += 0.25 * (after[a] - before[a]) * (after[a] - before[a]);
    }
    *bend_m = sqrt(bend2);
    return true;
}

/* Where a strand bends more sharply than fibers can, three nodes move towards a straight line until the bend is
 * allowed. Computes the sum of the moves of node i for the bends at node i and its two neighbours. */
static void unbend_at(struct relax *r, size_t i)
{
    const struct strand *t = &r->s->strand[r->strand_of[i]];
    for (int a = 0; a < 3; a++) r->move[i][a] = 0.0;
    for (long step = -1; step <= 1; step++) {
        double bend[3], bend_m, chord2;
        if (!bend_at(r->s, t, i, step, bend, &bend_m, &chord2)) continue;
        double most = MAX_STRAIN / t->radius_m * chord2;
        if (!(bend_m > most)) continue;
        double share = UNBEND * (step == 0 ? 2.0 : -1.0) / 6.0 * (1.0 - most / bend_m);
        for (int a = 0; a < 3; a++) r->move[i][a] += share * bend[a];
    }
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
        double bend[3], bend_m, chord2;
        if (bend_at(r->s, t, i, 0, bend, &bend_m, &chord2) && chord2 > 0.0)
            r->depth[n++] = t->radius_m * bend_m / chord2;
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
        sort_into_cells(&r);
        st = thread_pool_run(pool, n_task, look, &r, &quiet);
        if (st != STATUS_OK) goto out;
        if (i_round == n_round) break; /* the last look only measures */
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
