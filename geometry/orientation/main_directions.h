/* The directions in which the fibers of a cloth mainly run, and the matrix that brings weft to x and warp to y.
 *
 * Directions come from structure tensors (Bigun and Granlund 1987) at places spread over the volume, wherever there is material. The
 * histogram of their angle within the plane of x and y (smoothed by 8 degrees) has its highest peak at one system of yarns and the next, at
 * least 30 degrees away, at the other; crimp leans out of the plane and does not split a peak. Each system's direction is then the mean of
 * the directions that are nearer to it than to the other one and within 50 degrees in the plane, with signs that agree: the net way that
 * its fibers go, so that crimp and twist cancel. Repeated until it rests.
 * Only bricks of some 30 voxels are touched at a time, so the volume may be larger than memory. Results do not depend on the threads.
 */
#ifndef SELVEDGE_GEOMETRY_MAIN_DIRECTIONS_H
#define SELVEDGE_GEOMETRY_MAIN_DIRECTIONS_H

#include "base/thread_pool.h"
#include "geometry/volume/volume.h"

struct main_directions {
    size_t n; /* 0: none stands out; 1: one system of fibers; 2: weft and warp */
    double direction
        [2]
        [3]; /* unit, lengths in metres: [0] is nearer to x (weft), [1] to y (warp); with n = 1 one of the two is zero */
    double se_deg[2],
        tilt_se_deg
            [2]; /* standard error of each within the plane of x and y, and out of it (jackknife over columns of bricks) */
    double share[2]; /* of the directions, weighted: those that belong to it */
    double concentration
        [2]; /* mean squared cosine to the main direction among them: 1/3 for none at all, 1 for parallel fibers */
    double share_z;        /* of those that lean more than 60 degrees out of the plane of x and y */
    double contrast;       /* of the lower peak of the angle in the plane over the valley beside it */
    double repeat_m[2];    /* length of the repeat along each, 0 where none was found (repeat_direction.h) */
    double correlation[2]; /* of the cloth with itself, shifted by the repeat */
    size_t n_sample, n_brick;
};

/* material: scanner value from which on a blurred voxel counts as fiber. Cells at VOLUME_OUTSIDE count as void.
 * A volume without any material gives n = 0. STATUS_CANCELLED, STATUS_NO_MEMORY. */
status main_directions_find(const struct volume *v, double material, struct thread_pool *pool,
                            const struct progress *progress, struct main_directions *m, struct error *err);

enum align_outcome {
    ALIGN_DONE,
    ALIGN_NO_DIRECTION, /* felt, noise: nothing stands out */
    ALIGN_OTHER_AXES /* one leans more than 45 degrees out of the plane of x and y, or weft or warp is missing and fibers run along z */
};

struct alignment {
    enum align_outcome outcome;
    double matrix[9];           /* identity unless ALIGN_DONE; row-major, as the option OPTION_MATRIX */
    double rotation_deg;        /* of weft (or the one system) within the plane, from x towards y; before alignment */
    double shear_deg;           /* angle between warp and weft less 90 degrees */
    double tilt_deg;            /* of the plane of warp and weft (or of the one system) against x and y */
    double se_deg, tilt_se_deg; /* the larger of the two directions' standard errors */
};

/* A direction without a repeat (repeat_directions_refine) counts as lying in the plane of x and y. With two systems: weft to x, warp to y, their common normal to z (lengths along all three stay). With one: the turn by the shortest
 * way that brings it to the nearer of x and y. */
void alignment_from_directions(const struct main_directions *m, struct alignment *a);

#endif
