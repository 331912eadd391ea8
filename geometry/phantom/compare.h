/* How well reconstructed fibers agree with true ones.
 *
 * Both sets are walked in steps of one voxel of arc length; a sample stands for one voxel of fiber. Distances are taken to the nearest
 * point of the other set's polylines, periodic in x and y with the truth's tile. A sample is matched when that point lies within one
 * radius of the true fiber concerned. Directions have no sign.
 *
 * Where fibers are counted (missed, fragments, merges) a fiber of either set that leaves the tile by more than its radius ends there, and is
 * another one when it comes in on the other side: the scan shows one tile. True pieces of less than run_min_voxel are not counted.
 */
#ifndef SELVEDGE_GEOMETRY_COMPARE_H
#define SELVEDGE_GEOMETRY_COMPARE_H

#include "geometry/fibers/fiber_set.h"

struct compare_option {
    double voxel_size_m;
    double
        margin_m; /* samples nearer than this to a face of the tile in x or y are left out (a scan ends there); 0: none */
    double run_min_voxel; /* a found fiber counts as a fragment of a true one from this many samples on; 0: 5 */
};

struct compare_report {
    size_t n_true, n_found;      /* fibers */
    size_t n_true_piece;         /* true fibers as cut by the faces */
    double fiber_diameter_voxel; /* of the truth, mean weighted by length */
    double length_true_m, length_found_m;

    double center_recall; /* matched true samples / true samples */
    double
        center_precision; /* matched found samples, less second hits, / found samples. A second hit: another found fiber is
                                           matched nearer to the same voxel of the same true fiber */
    double centerline_rms_voxel; /* matched found samples to their true fiber */
    double centerline_p95_voxel;
    double
        length_recovered; /* share of true samples whose nearest found point is within one radius AND runs within 30 degrees */
    double
        longest_run; /* mean over true fibers of the longest stretch followed by one found fiber / the fiber's length */
    double missed;   /* share of true fibers without any fragment */
    double fragments_per_fiber; /* fragments / true fibers that have one */
    double gaps_per_fiber;      /* runs of unmatched samples between matched ones / true fibers */
    double merges_per_fiber;    /* sum over found fibers of (true fibers it has a fragment of - 1) / true fibers */
    double direction_mean_deg, direction_p95_deg; /* matched found samples, to the true polyline's direction there */
    double
        orientation_frobenius;  /* of the difference of the mean orientation tensors (mean of d d^T over all samples) */
    double radius_bias_percent; /* mean over matched found samples of found / true radius - 1 */
};

/* Figures without any sample to take them from are NaN. STATUS_INVALID (invalid sets, no voxel size), STATUS_NO_MEMORY. The found set's
 * tile size is not used. */
status compare_fibers(const struct fiber_set *truth, const struct fiber_set *found, const struct compare_option *o,
                      struct compare_report *report, struct error *err);

#endif
