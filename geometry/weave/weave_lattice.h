/* The lattice of a texture that repeats: the two shortest frequencies whose whole-number combinations include all peaks
 * of the spectrum. Its dual are the two shifts that map the texture to itself. Frequencies are in cycles per pixel, x
 * to the right and y down the picture; shifts in pixels. */
#ifndef SELVEDGE_GEOMETRY_WEAVE_LATTICE_H
#define SELVEDGE_GEOMETRY_WEAVE_LATTICE_H

#include "geometry/weave/weave_peaks.h"

enum { WEAVE_LATTICE_MAX = 4 };

struct weave_lattice {
    double f[2][2];        /* basis, reduced: f[0] the shortest, the angle between them 60 to 120 degrees */
    double shift_px[2][2]; /* dual basis: shift_px[i] . f[k] = 1 if i == k, else 0 */
    double explained;      /* share of the peaks' power that lies on the lattice */
    double information;    /* nats that the lattice saves in stating where the peaks are, per unit of amplitude */
    size_t n_peak;         /* that lie on it */
};

/* Finds the lattices that explain the peaks best, of different areas, the best first. A lattice that is n times finer
 * explains any peak ln n nats worse; it is better only if it explains peaks that the coarser one leaves. Frequencies
 * beyond half a cycle per pixel appear mirrored in the picture; the search accounts for that. resolution: the least
 * difference in cycles per pixel that the spectrum shows, 1 / edge of the picture. STATUS_NOT_FOUND: no two
 * independent peaks. */
status weave_find_lattices(const struct weave_peak *peak, size_t n_peak, double resolution,
                           struct weave_lattice lattice[WEAVE_LATTICE_MAX], size_t *n_lattice, struct error *err);

/* Reduces a basis in place (Lagrange-Gauss). */
void weave_reduce_basis(double f[2][2]);
/* shift[i] . f[k] = 1 if i == k, else 0. */
void weave_dual_basis(double f[2][2], double shift[2][2]);

#endif
