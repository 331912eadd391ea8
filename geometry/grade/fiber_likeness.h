/* Whether traced lines look like fibers: by their length over their width, and by where they end. */
#ifndef SELVEDGE_GEOMETRY_FIBER_LIKENESS_H
#define SELVEDGE_GEOMETRY_FIBER_LIKENESS_H

#include "geometry/fibers/fiber_set.h"
#include "geometry/volume/volume.h"

/* A line that is shorter than this, in diameters, and leaves the scan at neither end may be a particle. */
#define FIBER_LEAST_DIAMETERS 5.0

struct fiber_likeness {
    double particle_share; /* share of the length in such lines; NaN without fibers */
    /* Pieces a fiber: lines over the lines that there would be if each end in the middle of material, which is an end
     * that lost its fiber, met another one. NaN without fibers. */
    double fragments;
    size_t n_end, n_lost_end; /* ends inside of the scan, and those in the middle of material */
};

/* v: densities in [0, 1] in cubic voxels. safe: NULL, or a share of safe length of each fiber, which is set to 0 for
 * particles. */
void fiber_likeness_measure(const struct volume *v, const struct fiber_set *f, float *safe, struct fiber_likeness *l);

#endif
