/* A phantom, its scan, the reconstruction and how it agrees with the truth: what the accuracy tests and benches share. */
#ifndef SELVEDGE_TESTS_PHANTOM_RECONSTRUCTION_H
#define SELVEDGE_TESTS_PHANTOM_RECONSTRUCTION_H

#include "geometry/phantom/compare.h"
#include "geometry/phantom/phantom.h"
#include "geometry/reconstruct.h"

struct phantom_reconstruction {
    struct volume v; /* as mapped to [0, 1] */
    struct fiber_set truth, found;
    struct compare_report compare;
    struct reconstruct_option option;
    struct reconstruct_report report;
    double wall_s; /* of the reconstruction */
};

/* Cloth of fibers diameter_voxel thick at voxels of 2 um: the default phantom of the weave with all lengths scaled to the diameter, and
 * at least 38 fibers or 60 pieces of fiber in the tile. */
void phantom_cloth_of_diameter(struct phantom_option *o, enum phantom_weave weave, double diameter_voxel);
/* Blur 0.7 voxels, Gaussian noise. r->option may be changed before; start from reconstruct_option_default. */
status phantom_reconstruct(const struct phantom_option *o, double snr, struct phantom_reconstruction *r,
                           struct error *err);
void phantom_reconstruction_release(struct phantom_reconstruction *r);

#endif
