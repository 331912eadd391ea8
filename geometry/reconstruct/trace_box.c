#include "geometry/reconstruct/trace_box.h"

#include <math.h>
#include <string.h>

enum { SUM_STEP = 3 /* voxels */ };
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

/* Finds the box of n voxels with the most material, of a lattice of boxes that covers the volume. */
static void find_fullest(const struct volume *v, const size_t n[3], size_t fullest[3])
{
    size_t n_cell[3];
    double most = -1.0;
    for (int a = 0; a < 3; a++) n_cell[a] = (v->n[a] + n[a] - 1) / n[a];
    for (size_t c = 0; c < volume_n_voxel(n_cell); c++) {
        const size_t cell[3] = {c % n_cell[0], c / n_cell[0] % n_cell[1], c / (n_cell[0] * n_cell[1])};
        size_t from[3];
        for (int a = 0; a < 3; a++) from[a] = n_cell[a] == 1 ? 0 : cell[a] * (v->n[a] - n[a]) / (n_cell[a] - 1);
        const double sum = sum_densities(v, from, n);
        if (sum <= most) continue;
        most = sum;
        memcpy(fullest, from, sizeof from);
    }
}

status trace_box_copy(const struct volume *v, const struct volume *known, double diameter, struct volume *box,
                      size_t from[3], struct error *err)
{
    const size_t edge = (size_t)fmin(MOST_EDGE, fmax(LEAST_EDGE, EDGE_DIAMETERS * diameter));
    size_t n[3];
    for (int a = 0; a < 3; a++) {
        n[a] = v->n[a] < edge ? v->n[a] : edge;
        from[a] = 0;
    }
    find_fullest(known, n, from);
    status s = volume_init_in(box, n, v->voxel_size_m, v->space, err);
    for (size_t k = 0; k < n[2] && s == STATUS_OK; k++)
        for (size_t j = 0; j < n[1]; j++)
            memcpy(box->density + volume_index(n, 0, j, k),
                   v->density + volume_index(v->n, from[0], from[1] + j, from[2] + k), n[0] * sizeof *box->density);
    return s;
}
