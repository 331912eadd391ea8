/* Pushes fibers apart. Overlapping nodes of different fibers each move by half of the overlap, across their fibers.
 * Then the displacements are smoothed along each strand (not the positions, so crimp and twist stay), and bends that
 * would break a fiber are straightened. These are Jacobi rounds: all nodes are evaluated before any node moves. */
#include "geometry/cloth/strand_contact.h"
#include "geometry/cloth/strand_step.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ROWS_PER_TASK = 8, STRANDS_PER_TASK = 32 };

struct relax {
    struct strand_set *s;
    uint32_t *strand_of; /* node -> strand */
    struct strand_moves moves;
    struct strand_contacts contacts;
    double smoothing; /* of the present round */
    double *work;     /* n_work numbers for each thread */
    size_t n_work;
    struct strand_grid grid;
};

static void relax_release(struct relax *r)
{
    free(r->strand_of);
    free(r->moves.push);
    free(r->moves.step);
    free(r->contacts.depth);
    free(r->work);
    strand_grid_release(&r->grid);
}

static status relax_init(struct relax *r, struct strand_set *s, enum strand_rule rule, size_t n_thread,
                         struct error *err)
{
    size_t longest = 0;
    *r = (struct relax){.s = s};
    for (size_t i = 0; i < s->n_strand; i++) longest = s->strand[i].n > longest ? s->strand[i].n : longest;
    r->n_work = strand_step_work(longest);
    r->strand_of = calloc(s->n_node, sizeof *r->strand_of);
    r->moves.push = calloc(s->n_node, sizeof *r->moves.push);
    r->moves.step = calloc(s->n_node, sizeof *r->moves.step);
    r->contacts = (struct strand_contacts){
        .s = s, .grid = &r->grid, .rule = rule, .depth = calloc(s->n_node, sizeof *r->contacts.depth)};
    r->work = calloc(n_thread * r->n_work, sizeof *r->work);
    if (!r->strand_of || !r->moves.push || !r->moves.step || !r->contacts.depth || !r->work)
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

/* Looks from the nodes of some rows of cells. */
static void look(void *context, size_t i_task, size_t i_thread)
{
    struct relax *r = context;
    size_t n_row = r->grid.n_cell[1] * r->grid.n_cell[2],
           end = (i_task + 1) * ROWS_PER_TASK < n_row ? (i_task + 1) * ROWS_PER_TASK : n_row;
    (void)i_thread;
    for (size_t i = i_task * ROWS_PER_TASK; i < end; i++) strand_contacts_of_row(&r->contacts, i, r->moves.push);
}

/* Moves some of the strands, each by itself. */
static void move_strands(void *context, size_t i_task, size_t i_thread)
{
    struct relax *r = context;
    struct strand_set *s = r->s;
    size_t end = (i_task + 1) * STRANDS_PER_TASK < s->n_strand ? (i_task + 1) * STRANDS_PER_TASK : s->n_strand;
    for (size_t i = i_task * STRANDS_PER_TASK; i < end; i++)
        if (!s->strand[i].fixed) strand_step(s, &s->strand[i], &r->moves, r->smoothing, r->work + i_thread * r->n_work);
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
        if (t->fixed || !neighbour(t, i, -1, r->s->p, before) || !neighbour(t, i, 1, r->s->p, after)) continue;
        double bend2 = strand_bend(before, r->s->p[i], after, bend, &chord2);
        if (chord2 > 0.0) r->contacts.depth[n++] = t->radius_m * sqrt(bend2) / chord2;
    }
    qsort(r->contacts.depth, n, sizeof *r->contacts.depth, ascending);
    return n > 0 ? r->contacts.depth[(size_t)(0.95 * (double)(n - 1))] : 0.0;
}

/* Measures the interpenetration and the sharp bends that are left at the present places. */
static void measure(struct relax *r, struct strand_fit *fit)
{
    size_t n_node = r->s->n_node;
    fit->overlap_mean = fit->overlap_max = 0.0;
    for (size_t i = 0; i < r->s->n_strand; i++) n_node -= r->s->strand[i].fixed ? r->s->strand[i].n : 0;
    for (size_t k = 0; k < r->s->n_node; k++) {
        fit->overlap_mean += r->contacts.depth[k] / (double)n_node;
        fit->overlap_max = fmax(fit->overlap_max, r->contacts.depth[k]);
    }
    fit->strain_p95 = strain_p95(r);
}

status strand_relax(struct strand_set *s, const struct strand_relax_option *o, struct thread_pool *pool,
                    const struct progress *progress, struct strand_fit *fit, struct error *err)
{
    const size_t n_round = o->n_round;
    struct relax r;
    status st = STATUS_OK;
    memcpy(s->p, s->start, s->n_node * sizeof *s->p);
    st = relax_init(&r, s, o->rule, pool != NULL ? thread_pool_n_thread(pool) : 1, err);
    if (st != STATUS_OK) goto out;
    const size_t n_row = r.grid.n_cell[1] * r.grid.n_cell[2], n_look = (n_row + ROWS_PER_TASK - 1) / ROWS_PER_TASK,
                 n_move = (s->n_strand + STRANDS_PER_TASK - 1) / STRANDS_PER_TASK;
    const struct progress quiet = progress_silent(progress);
    for (size_t i_round = 0; i_round < n_round; i_round++) {
        strand_grid_sort(&r.grid, s, r.strand_of);
        st = thread_pool_run(pool, n_look, look, &r, &quiet);
        if (st != STATUS_OK) goto out;
        /* smoothing decreases, so that the last rounds only separate */
        r.smoothing = 1.0 - 0.9 * (double)i_round / (double)n_round;
        st = thread_pool_run(pool, n_move, move_strands, &r, &quiet);
        if (st != STATUS_OK) goto out;
        progress_report(progress, (double)(i_round + 1) / (double)n_round);
    }
    if (fit == NULL) goto out;
    strand_grid_sort(&r.grid, s, r.strand_of);
    st = thread_pool_run(pool, n_look, look, &r, &quiet);
    if (st == STATUS_OK) measure(&r, fit);
out:
    relax_release(&r);
    return st == STATUS_CANCELLED ? error_set(err, st, "cancelled while making the fibers") : st;
}
