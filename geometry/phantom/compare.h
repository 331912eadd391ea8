/* Compares reconstructed fibers with true ones.
 *
 * Both sets are sampled in steps of one voxel of arc length, so a sample stands for one voxel of fiber. Distances
 * are taken to the nearest point of the other set's polylines, periodic in x and y with the tile of the truth. A
 * sample is matched if that point lies within one radius of the true fiber concerned. Directions have no sign.
 *
 * The scan shows one tile. Where fibers are counted (missed, fragments, merges), a fiber of either set that leaves
 * the tile by more than its radius ends there, and counts as another fiber when it enters at the opposite side. True
 * pieces of less than run_min_voxel are not counted. */
#ifndef SELVEDGE_GEOMETRY_COMPARE_H
#define SELVEDGE_GEOMETRY_COMPARE_H

#include "geometry/fibers/fiber_set.h"

struct compare_option {
    double voxel_size_m;
    /* Samples nearer than this to a face of the tile in x or y are left out, as a scan ends there; 0: none. */
    double margin_m;
    double run_min_voxel; /* a found fiber is a fragment of a true one if it has at least this many samples; 0: 5 */
};

struct compare_report {
    size_t n_true, n_found;      /* fibers */
    size_t n_true_piece;         /* pieces of true fibers between the faces */
    double fiber_diameter_voxel; /* of the truth, weighted by length */
    double length_true_m, length_found_m;

    double center_recall;    /* matched true samples / true samples */
    double center_recall_se; /* its standard error, from the scatter between true fibers; NaN for a single one */
    /* (Matched found samples without second hits) / found samples. A second hit: another found fiber is matched
     * nearer to the same voxel of the same true fiber. */
    double center_precision;
    double centerline_rms_voxel; /* of matched found samples from their true fiber */
    double centerline_p95_voxel;
    /* Share of true samples whose nearest found point is within one radius and whose directions differ by at most 30
     * degrees. */
    double length_recovered;
    /* Mean over true fibers of the longest part that one found fiber follows, as a share of the length of the fiber. */
    double longest_run;
    double missed;              /* share of true fibers without a fragment */
    double fragments_per_fiber; /* fragments / true fibers that have one */
    double fragments_se;        /* its standard error, from the scatter between these; NaN for a single one */
    double gaps_per_fiber;      /* runs of unmatched samples between matched ones / true fibers */
    double merges_per_fiber;    /* sum over found fibers of (true fibers in it - 1) / true fibers */
    double direction_mean_deg, direction_p95_deg; /* of matched found samples from the direction of the true polyline */
    /* Frobenius norm of the difference of the mean orientation tensors (mean of d d^T over all samples). */
    double orientation_frobenius;
    double radius_bias_percent; /* mean over matched found samples of found / true radius - 1 */
    double radius_rms_percent;  /* root of the mean square of the same */
};

/* Figures without samples are NaN. The tile size of the found set is not used. STATUS_INVALID (invalid sets, no
 * voxel size), STATUS_NO_MEMORY. */
status compare_fibers(const struct fiber_set *truth, const struct fiber_set *found, const struct compare_option *o,
                      struct compare_report *report, struct error *err);

#endif
