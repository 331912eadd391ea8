/* Measures the radius of the fibers (fabric thesis, 5.6.5).
 *
 * On the volume upsampled four times along each axis, let V be the points of material and C(r) the points within r
 * of a polyline:
 *     score(r) = |C(r) and V| - |C(r) xor V|.
 * One pass over bricks of the fine grid gives the distance to the nearest polyline at every point. Histograms of
 * this distance inside and outside of V give the score for all r at once. */
#ifndef SELVEDGE_GEOMETRY_RADIUS_H
#define SELVEDGE_GEOMETRY_RADIUS_H

#include "base/thread_pool.h"
#include "geometry/fibers/lines/segment_bricks.h"
#include "geometry/volume/volume.h"

#include <stdbool.h>

enum { RADIUS_BINS = 512, RADIUS_UPSAMPLING = 4, RADIUS_PARTS = 8 };

/* Histograms of the points of the fine grid by distance to the nearest polyline and by its axis class. */
struct distance_histogram {
    double bin_voxel;                /* width of a bin */
    uint64_t inside[3][RADIUS_BINS]; /* points of V */
    uint64_t outside[3][RADIUS_BINS];
    uint64_t density_sum[3][RADIUS_BINS];            /* sum of round(255 density) over all points of the bin */
    uint64_t far_inside, far_count, far_density_sum; /* points farther than the last bin from every polyline */
    double length_voxel[3];                          /* length of the polylines of each class */
};

/* part: RADIUS_PARTS histograms of disjoint sets of bricks scattered over the volume. Their sum is the histogram of the
 * volume, and their differences give the standard error of a radius. eps_d: density that counts as material (the
 * density is interpolated, so V has smooth surfaces). farthest_voxel: end of the last bin. If more than 500 bricks have
 * fibers near them, about 500 are measured. Integers are summed, so the result does not depend on the threads.
 * STATUS_CANCELLED, STATUS_NO_MEMORY. */
status distance_histogram_measure(const struct volume *v, const struct polyline_set *lines, double eps_d,
                                  double farthest_voxel, struct thread_pool *pool, const struct progress *progress,
                                  struct distance_histogram part[RADIUS_PARTS], struct error *err);
/* Adds all parts except one, or all of them if `without` is RADIUS_PARTS. */
void distance_histogram_sum(const struct distance_histogram part[RADIUS_PARTS], size_t without,
                            struct distance_histogram *sum);

/* score(r) / |V| over the classes whose bit is set in `classes`, where V is the material within reach of a polyline;
 * and the r >= 0.25 voxels with the best score. 0 if the classes have no polyline. */
double radius_score(const struct distance_histogram *h, unsigned classes, double r_voxel);
double radius_best_score(const struct distance_histogram *h, unsigned classes);

/* An improvement on the paper. The best score lies at the r where a third of the points at distance r are material,
 * so everything that softens the surface makes fibers too thick: the scanner's blur, small errors of the polylines,
 * gaps in a bundle that blur fills. The amount of material is not affected: pi r^2 times the length of the polylines
 * equals the sum of (density - void) / (solid - void) over points nearer than 1.7 r. A few rounds from r_start solve
 * for r; solid is the density within 0.4 r of the polylines. */
double radius_from_mass(const struct distance_histogram *h, unsigned classes, double r_start_voxel);

enum radius_rule { RADIUS_AUTO, RADIUS_COMMON, RADIUS_PER_AXIS };

struct radius_measure {
    /* Per axis class; the standard error by leaving out one part at a time (jackknife). */
    double radius_voxel[3], se_voxel[3];
    bool per_axis;
};

/* Chooses one radius for all classes or one for each. RADIUS_AUTO: one for each if two of them differ by more than
 * RADIUS_SIGMAS standard errors of the difference and by more than RADIUS_SYSTEMATIC of the radius, which is the
 * largest shift by blur and touching neighbours. Classes without fibers get the common radius. STATUS_NO_MEMORY. */
#define RADIUS_SIGMAS 3.0
#define RADIUS_SYSTEMATIC 0.05
status radius_choose(const struct distance_histogram part[RADIUS_PARTS], enum radius_rule rule,
                     struct radius_measure *m, struct error *err);

/* Replaces the radii of the classes by those that the lines have. se_voxel: their standard error, which all share. */
void radius_measure_lines(const struct polyline_set *lines, double se_voxel, struct radius_measure *m);
/* Gives every line the radius of its class. single: scales the radii that the lines have, of their profiles, together
 * to the mass of the class (of all lines, if the classes share a radius). */
void polylines_set_radii(struct polyline_set *lines, const struct radius_measure *m, bool single);

#endif
