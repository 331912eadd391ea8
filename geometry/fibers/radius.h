/* The radius of the fibers (fabric thesis, 5.6.5).
 *
 * On the volume upsampled four times per axis, V = points of material, C(r) = points within r of a polyline:
 *     score(r) = |C(r) and V| - |C(r) xor V|.
 * One pass over bricks of the fine grid gives the distance to the nearest polyline at every point; histograms of that
 * distance inside and outside of V give the score at every r at once.
 */
#ifndef SELVEDGE_GEOMETRY_RADIUS_H
#define SELVEDGE_GEOMETRY_RADIUS_H

#include "base/thread_pool.h"
#include "geometry/fibers/segment_bricks.h"
#include "geometry/volume/volume.h"

enum { RADIUS_BINS = 512, RADIUS_UPSAMPLING = 4 };

/* Points of the fine grid by distance to the nearest polyline and the axis class of that polyline. */
struct distance_histogram {
    double bin_voxel;                        /* width of a bin */
    uint64_t inside[3][RADIUS_BINS];         /* points of V */
    uint64_t outside[3][RADIUS_BINS];
    uint64_t density_sum[3][RADIUS_BINS];    /* sum of round(255 density) over all points of the bin */
    uint64_t inside_far;                     /* points of V farther than the last bin from every polyline */
};

/* eps_d: density that counts as material (the density is interpolated, so V has smooth surfaces). */
status distance_histogram_measure(const struct volume *v, const struct polyline_set *lines, double eps_d,
                                  double farthest_voxel, struct thread_pool *pool, const struct progress *progress,
                                  struct distance_histogram *h, struct error *err);

/* r of the best score in voxels over classes with bit set in `classes`, r from 0.25 to the end of the histogram; *score is
 * score(r) / |V| (within reach), *dice = 2 |C and V| / (|C| + |V|). 0 when the classes have no polyline. */
double radius_best_score(const struct distance_histogram *h, unsigned classes, double *score, double *dice);

#endif
