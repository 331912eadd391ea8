/* The main directions of the fibers of a cloth: the directions of weft and warp, or of its only system of fibers.
 *
 * Directions come from structure tensors (Bigun and Granlund 1987) at places spread over the volume where there is
 * material. The histogram of their angle within the plane of x and y, smoothed by 8 degrees, has its highest peak at
 * one system of yarns, and its next highest at least 30 degrees away at the other. Crimp leans out of the plane and so
 * does not split a peak. The direction of each system is the mean of the voxels' directions that are nearer to it than
 * to the other system, and within 50 degrees of it in the plane. Directions get equal signs first. The mean is the net
 * course of the fibers, in which crimp and twist cancel. The assignment and the mean are repeated until they no longer
 * change.
 *
 * Only bricks of some 30 voxels are read at a time, so the volume may be larger than memory. Results do not depend on
 * the number of threads. */
#ifndef SELVEDGE_GEOMETRY_MAIN_DIRECTIONS_H
#define SELVEDGE_GEOMETRY_MAIN_DIRECTIONS_H

#include "base/thread_pool.h"
#include "geometry/volume/volume.h"

struct main_directions {
    size_t n; /* 0: no clear direction; 1: one system of fibers; 2: weft and warp */
    /* Unit vectors, by lengths in metres: [0] is nearer to x (weft), [1] to y (warp). With n = 1 one of them is
     * zero. */
    double direction[2][3];
    /* Standard errors of each within the plane of x and y, and out of it (jackknife over columns of bricks). */
    double se_deg[2], tilt_se_deg[2];
    double share[2]; /* share of the weighted directions that belong to it */
    /* Mean squared cosine of these to the main direction: 1/3 for random directions, 1 for parallel fibers. */
    double concentration[2];
    double share_z;        /* share of directions more than 60 degrees out of the plane of x and y */
    double contrast;       /* of the lower peak of the angle in the plane over the valley beside it */
    double repeat_m[2];    /* length of the repeat along each, 0 where none was found (repeat_direction.h) */
    double correlation[2]; /* correlation of the cloth with itself shifted by the repeat */
    size_t n_sample, n_brick;
};

/* material: scanner value from which on a blurred voxel counts as fiber. Voxels at VOLUME_OUTSIDE count as void. A
 * volume without material gives n = 0. STATUS_CANCELLED, STATUS_NO_MEMORY. */
status main_directions_find(const struct volume *v, double material, struct thread_pool *pool,
                            const struct progress *progress, struct main_directions *m, struct error *err);

#endif
