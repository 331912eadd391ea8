/* Cells of the grid of a cloth: inside of capsule_cloth.c and capsule_walk.c. */
#ifndef SELVEDGE_TESTS_CAPSULE_ENTRY_H
#define SELVEDGE_TESTS_CAPSULE_ENTRY_H

#include "tests/exact/capsule_cloth.h"

/* A capsule that may meet a cell, and by which copy, shifted by whole tiles. */
struct capsule_entry {
    uint32_t i_capsule;
    int shift[2];
};

/* The number of a cell of the endless cloth within its tile, which is returned, too. */
static inline size_t capsule_cell(const struct capsule_cloth *c, const int at[3], int tile[2])
{
    int in[2];
    for (int k = 0; k < 2; k++) {
        const int n = c->n_cell[k];
        tile[k] = at[k] >= 0 ? at[k] / n : -((n - 1 - at[k]) / n);
        in[k] = at[k] - tile[k] * n;
    }
    return ((size_t)at[2] * (size_t)c->n_cell[1] + (size_t)in[1]) * (size_t)c->n_cell[0] + (size_t)in[0];
}

#endif
