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
#include "geometry/fibers/lines/segment_bricks.h"
#include "geometry/volume/volume.h"

#include <stdbool.h>

enum { RADIUS_BINS = 512, RADIUS_UPSAMPLING = 4, RADIUS_PARTS = 8 };

/* Points of the fine grid by distance to the nearest polyline and the axis class of that polyline. */
struct distance_histogram {
    double bin_voxel;                /* width of a bin */
    uint64_t inside[3][RADIUS_BINS]; /* points of V */
    uint64_t outside[3][RADIUS_BINS];
    uint64_t density_sum[3][RADIUS_BINS];            /* sum of round(255 density) over all points of the bin */
    uint64_t far_inside, far_count, far_density_sum; /* points farther than the last bin from every polyline */
    double length_voxel[3];                          /* of the polylines of each class */
};

/* part: RADIUS_PARTS histograms, of disjoint sets of bricks scattered over the volume (their sum is that of the volume); they tell how
 * sure a radius is.
 * eps_d: density that counts as material (the density is interpolated, so V has smooth surfaces). farthest_voxel: end of the last bin. Of more than
 * 1500 bricks with fibers near them some 1500 are measured. Whole numbers are summed: nothing depends on threads. STATUS_CANCELLED,
 * STATUS_NO_MEMORY. */
status distance_histogram_measure(const struct volume *v, const struct polyline_set *lines, double eps_d,
                                  double farthest_voxel, struct thread_pool *pool, const struct progress *progress,
                                  struct distance_histogram part[RADIUS_PARTS], struct error *err);
/* Sum of all parts but one; RADIUS_PARTS: of all. */
void distance_histogram_sum(const struct distance_histogram part[RADIUS_PARTS], size_t without,
                            struct distance_histogram *sum);

/* score(r) / |V| over the classes with bit set in `classes`, V within reach of a polyline; and the r >= 0.25 voxels of the best score.
 * 0 when the classes have no polyline. */
double radius_score(const struct distance_histogram *h, unsigned classes, double r_voxel);
double radius_best_score(const struct distance_histogram *h, unsigned classes);

/* Past the paper. The best score lies where a third of the points at distance r are material, so everything that softens the surface (the
 * scanner's blur, small errors of the polylines, gaps in a bundle that blur fills) makes fibers too thick. Mass does not care:
 * pi r^2 times the length of the polylines is the amount of material around them, sum of (density - void) / (solid - void)
 * over points nearer than 1.7 r (a few rounds, from r_start); solid is the density within 0.4 r of the polylines. */
double radius_from_mass(const struct distance_histogram *h, unsigned classes, double r_start_voxel);

enum radius_rule { RADIUS_AUTO, RADIUS_COMMON, RADIUS_PER_AXIS };

struct radius_measure {
    double radius_voxel[3],
        se_voxel[3]; /* per axis class; the standard error by leaving out one part at a time (jackknife) */
    bool per_axis;
};

/* One radius for all classes, or one each. RADIUS_AUTO: one each when two of them differ by more than RADIUS_SIGMAS standard errors of the
 * difference and by more than RADIUS_SYSTEMATIC of the radius (blur and touching neighbours shift radii by up to so much). Classes
 * without fibers take the common one. STATUS_NO_MEMORY. */
#define RADIUS_SIGMAS 3.0
#define RADIUS_SYSTEMATIC 0.05
status radius_choose(const struct distance_histogram part[RADIUS_PARTS], enum radius_rule rule,
                     struct radius_measure *m, struct error *err);

#endif
