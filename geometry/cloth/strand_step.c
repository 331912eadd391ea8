/* The nodes of a strand are held as three rows of coordinates, so that the compiler makes vectors of nodes. */
#include "geometry/cloth/strand_step.h"

#include <math.h>

/* N_UNBEND: steps per round. PAD: places before and behind the nodes of a row, for those beyond the ends. */
enum { N_UNBEND = 6, PAD = 2 };

/* Share of its last step by which a node moves again (heavy-ball momentum). A stack of fibers then separates in a
 * sixth of the rounds. */
static const double momentum = 0.8;
/* The surface of a bent fiber is strained by its radius over the radius of the bend. Textile fibers break at 3 %
 * (flax) to about 40 % (wool, polyester), so no fiber bends more sharply than this, which is a radius of curvature
 * of two diameters. */
static const double MAX_STRAIN = 0.25;
/* share of a correction applied at once, because the corrections of neighbouring bends add up */
static const double UNBEND = 0.5;

/* Coordinates of the nodes 0 to n - 1 of a strand; row[a][-PAD] to row[a][n - 1 + PAD] exist. */
struct rows {
    double *row[3];
};

enum { ROWS = 2 };

size_t strand_step_work(size_t n) { return (size_t)(3 * ROWS) * (n + 2 * PAD); }

static struct rows rows_at(double *work, size_t n, size_t i)
{
    struct rows r;
    for (size_t a = 0; a < 3; a++) r.row[a] = work + (3 * i + a) * (n + 2 * PAD) + PAD;
    return r;
}

/* Fills the places beyond the ends. A closed strand goes on, moved by `shift` (NULL: not moved); an open one repeats
 * its last node. */
static void pad(const struct strand *t, const double *shift, struct rows *r)
{
    for (int a = 0; a < 3; a++) {
        double *row = r->row[a], by = shift != NULL && a < 2 ? shift[a] : 0.0;
        for (size_t k = 1; k <= PAD; k++) {
            row[-(long)k] = t->n_period > 0 ? row[t->n - k] - by : row[0];
            row[t->n - 1 + k] = t->n_period > 0 ? row[k - 1] + by : row[t->n - 1];
        }
    }
}

/* Computes in `move` the mean of the moves that the contacts of each node ask for, without the part along the fiber,
 * which would only shuffle nodes. q: the nodes. */
static void settle(const struct strand *t, const struct strand_moves *m, const struct rows *q, struct rows *move)
{
    const double *x = q->row[0], *y = q->row[1], *z = q->row[2];
    double *restrict out_x = move->row[0], *restrict out_y = move->row[1], *restrict out_z = move->row[2];
    for (long k = 0; k < (long)t->n; k++) {
        const struct strand_push *push = &m->push[t->first + (size_t)k];
        const double *sum = push->sum_m, n = push->n_contact, per = 0.5 * n + 0.5;
        double along[3] = {x[k + 1] - x[k - 1], y[k + 1] - y[k - 1], z[k + 1] - z[k - 1]};
        double length2 = along[0] * along[0] + along[1] * along[1] + along[2] * along[2];
        double dot = along[0] * sum[0] + along[1] * sum[1] + along[2] * sum[2];
        out_x[k] = n == 0.0 ? 0.0 : (sum[0] - dot * along[0] / length2) / per; /* 0: nothing touches it */
        out_y[k] = n == 0.0 ? 0.0 : (sum[1] - dot * along[1] / length2) / per;
        out_z[k] = n == 0.0 ? 0.0 : (sum[2] - dot * along[2] / length2) / per;
    }
}

/* Takes the step of one coordinate: `row` gets the displacement of the nodes q from their starts. */
static void displace(const struct strand_set *s, const struct strand *t, const struct strand_moves *m, int a,
                     const double *restrict q, double *restrict row)
{
    double(*step)[3] = m->step + t->first;
    const double(*start)[3] = (const double(*)[3])(s->start + t->first);
    for (size_t k = 0; k < t->n; k++) {
        step[k][a] = row[k] + momentum * step[k][a];
        row[k] = q[k] + step[k][a] - start[k][a];
    }
}

/* q = start + displacement, smoothed once with weights 1/4 1/2 1/4 blended by `amount`. */
static void smooth(const struct strand_set *s, const struct strand *t, int a, const double *restrict displacement,
                   double amount, double *restrict q)
{
    const double(*start)[3] = (const double(*)[3])(s->start + t->first);
    for (long k = 0; k < (long)t->n; k++) {
        double own = displacement[k], mean = 0.5 * own + 0.25 * (displacement[k - 1] + displacement[k + 1]);
        q[k] = start[k][a] + own + amount * (mean - own);
    }
}

/* Computes the moves that the bend at each node asks for: where a strand bends more sharply than fibers can, the node
 * and its two neighbours move towards a straight line until the bend is allowed. `want` is the move of a neighbour,
 * with its sign turned; the node moves by twice as much. Returns whether any bend is too sharp. from, to: nodes with a
 * bend. */
static bool find_bends(const struct rows *q, long from, long to, double most_per_chord2, struct rows *want)
{
    const double *x = q->row[0], *y = q->row[1], *z = q->row[2];
    double *restrict want_x = want->row[0], *restrict want_y = want->row[1], *restrict want_z = want->row[2];
    long n_sharp = 0;
    for (long k = from; k < to; k++) {
        double bend_x = x[k - 1] - 2.0 * x[k] + x[k + 1], chord_x = x[k + 1] - x[k - 1];
        double bend_y = y[k - 1] - 2.0 * y[k] + y[k + 1], chord_y = y[k + 1] - y[k - 1];
        double bend_z = z[k - 1] - 2.0 * z[k] + z[k + 1], chord_z = z[k + 1] - z[k - 1];
        double bend2 = bend_x * bend_x + bend_y * bend_y + bend_z * bend_z;
        double chord2 = 0.25 * chord_x * chord_x + 0.25 * chord_y * chord_y + 0.25 * chord_z * chord_z;
        double most = most_per_chord2 * chord2, share = UNBEND / 6.0 * (1.0 - most / sqrt(bend2));
        bool sharp = bend2 > most * most;
        share = sharp ? share : 0.0;
        n_sharp += sharp;
        want_x[k] = share * bend_x;
        want_y[k] = share * bend_y;
        want_z[k] = share * bend_z;
    }
    return n_sharp > 0;
}

/* Straightens bends that are too sharp. `want`: working memory. */
static void unbend(const struct strand *t, struct rows *q, struct rows *want)
{
    const bool closed = t->n_period > 0;
    const long n = (long)t->n, from = closed ? -1 : 1, to = closed ? n + 1 : n - 1;
    for (int a = 0; a < 3; a++) {
        double *row = want->row[a], *before = row - 1;
        *before = row[0] = row[n - 1] = row[n] = 0.0;
    }
    for (int i = 0; i < N_UNBEND; i++) {
        pad(t, t->shift, q);
        if (!find_bends(q, from, to, MAX_STRAIN / t->radius_m, want)) return; /* nor would the next steps move it */
        for (int a = 0; a < 3; a++) {
            const double *restrict w = want->row[a];
            double *restrict row = q->row[a];
            for (long k = 0; k < n; k++) row[k] += -w[k - 1] + 2.0 * w[k] - w[k + 1];
        }
    }
}

void strand_step(struct strand_set *s, const struct strand *t, const struct strand_moves *m, double smoothing,
                 double *work)
{
    struct rows q = rows_at(work, t->n, 0), other = rows_at(work, t->n, 1);
    double(*p)[3] = s->p + t->first;
    for (size_t k = 0; k < t->n; k++)
        for (int a = 0; a < 3; a++) q.row[a][k] = p[k][a];
    pad(t, t->shift, &q);
    settle(t, m, &q, &other);
    for (int a = 0; a < 3; a++) displace(s, t, m, a, q.row[a], other.row[a]);
    pad(t, NULL, &other);
    for (int a = 0; a < 3; a++) smooth(s, t, a, other.row[a], smoothing, q.row[a]);
    unbend(t, &q, &other);
    for (size_t k = 0; k < t->n; k++)
        for (int a = 0; a < 3; a++) p[k][a] = q.row[a][k];
}
