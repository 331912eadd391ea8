/* One round of a strand by itself, after its contacts with other strands are known: it moves by the mean of the moves
 * that they ask for, its displacement is smoothed, and bends that would break a fiber are straightened. A strand takes
 * all of this in one go, while its nodes are in the cache. */
#ifndef SELVEDGE_GEOMETRY_STRAND_STEP_H
#define SELVEDGE_GEOMETRY_STRAND_STEP_H

#include "geometry/cloth/strand.h"

/* The moves that the contacts of a node ask for. */
struct strand_push {
    double sum_m[3];  /* of the moves */
    double n_contact; /* as the rule counts them */
};

/* Of all nodes of a set. */
struct strand_moves {
    struct strand_push *push;
    double (*step)[3]; /* taken last */
};

/* Numbers of working memory for a strand of n nodes. */
size_t strand_step_work(size_t n);

/* Moves the nodes of t, one of the strands of s. smoothing: 1 smooths the displacements fully, 0 not at all. */
void strand_step(struct strand_set *s, const struct strand *t, const struct strand_moves *m, double smoothing,
                 double *work);

/* The bend at the middle one of three nodes: the second difference of the positions. Returns its square, and in *chord2
 * the square of half of the chord. */
static inline double strand_bend(const double before[3], const double at[3], const double after[3], double bend[3],
                                 double *chord2)
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

#endif
