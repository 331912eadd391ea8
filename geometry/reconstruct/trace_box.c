#include "geometry/reconstruct/trace_box.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SUM_STEP = 3 /* voxels */, LEAST_FULL = 27 /* boxes with material from which on others are chosen */ };
/* Edge of the box in diameters, and its bounds in voxels. */
static const double EDGE_DIAMETERS = 10.0, LEAST_EDGE = 48.0, MOST_EDGE = 96.0;

/* Sum of the densities of every third voxel along each axis. */
static double sum_densities(const struct volume *v, const size_t from[3], const size_t n[3])
{
    double sum = 0.0;
    scratch_keep_within(v->space);
    for (size_t k = from[2]; k < from[2] + n[2]; k += SUM_STEP)
        for (size_t j = from[1]; j < from[1] + n[1]; j += SUM_STEP)
            for (size_t i = from[0]; i < from[0] + n[0]; i += SUM_STEP)
                sum += (double)v->density[volume_index(v->n, i, j, k)];
    return sum;
}

/* A box of a lattice that covers the volume. */
struct cell {
    double sum; /* of densities */
    size_t from[3];
};

static int by_falling_sum(const void *a, const void *b)
{
    const double x = ((const struct cell *)a)->sum, y = ((const struct cell *)b)->sum;
    return (x < y) - (x > y);
}

/* Finds box number i_box of n voxels. Returns false where there are too few others. */
static bool choose(struct cell *cell, size_t n_cell, int i_box, size_t from[3])
{
    size_t n_full = 0, first = 0;
    for (size_t c = 1; c < n_cell; c++)
        if (cell[c].sum > cell[first].sum) first = c;
    memcpy(from, cell[first].from, sizeof cell->from);
    if (i_box == 0) return true;
    qsort(cell, n_cell, sizeof *cell, by_falling_sum);
    while (n_full < n_cell && cell[n_full].sum >= 0.5 * cell[0].sum) n_full++;
    memcpy(from, cell[n_full * (size_t)i_box / TRACE_N_BOX].from, sizeof cell->from);
    return n_full >= LEAST_FULL;
}

/* Finds box number i_box of n voxels, of a lattice of boxes that covers the volume. */
static status find_box(const struct volume *v, const size_t n[3], int i_box, size_t from[3], bool *found,
                       struct error *err)
{
    size_t n_cell[3];
    for (int a = 0; a < 3; a++) n_cell[a] = (v->n[a] + n[a] - 1) / n[a];
    struct cell *cell = malloc(volume_n_voxel(n_cell) * sizeof *cell);
    if (cell == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot look for fibers: out of memory");
    for (size_t c = 0; c < volume_n_voxel(n_cell); c++) {
        const size_t at[3] = {c % n_cell[0], c / n_cell[0] % n_cell[1], c / (n_cell[0] * n_cell[1])};
        for (int a = 0; a < 3; a++) cell[c].from[a] = n_cell[a] == 1 ? 0 : at[a] * (v->n[a] - n[a]) / (n_cell[a] - 1);
        cell[c].sum = sum_densities(v, cell[c].from, n);
    }
    *found = choose(cell, volume_n_voxel(n_cell), i_box, from);
    free(cell);
    return STATUS_OK;
}

status trace_box_copy(const struct volume *v, const struct volume *known, double diameter, int i_box,
                      struct volume *box, size_t from[3], struct error *err)
{
    const size_t edge = (size_t)fmin(MOST_EDGE, fmax(LEAST_EDGE, EDGE_DIAMETERS * diameter));
    size_t n[3];
    for (int a = 0; a < 3; a++) {
        n[a] = v->n[a] < edge ? v->n[a] : edge;
        from[a] = 0;
    }
    bool found = false;
    status s = find_box(known, n, i_box, from, &found, err);
    if (s != STATUS_OK || !found) return s;
    s = volume_init_in(box, n, v->voxel_size_m, v->space, err);
    for (size_t k = 0; k < n[2] && s == STATUS_OK; k++)
        for (size_t j = 0; j < n[1]; j++)
            memcpy(box->density + volume_index(n, 0, j, k),
                   v->density + volume_index(v->n, from[0], from[1] + j, from[2] + k), n[0] * sizeof *box->density);
    return s;
}
