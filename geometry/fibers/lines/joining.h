/* Joins the pieces of one fiber into one polyline, which the paper does not do.
 *
 * 1. Duplicates: a fiber near 45 degrees is found in two subvolumes. Where two lines pass each other within half a
 * diameter (and at least within a voxel), the vertices of the shorter are removed.
 * 2. Joins: two free ends are joined if one smooth curve passes through the last vertices of both (join_curve.h),
 * and the way between them is short, lies in material and is not on another line. Ends at a face of the volume stay
 * free. The best pairs are joined first. Where the blur of the scan is known, the scan must also look more like one
 * fiber there than like two (join_evidence.h). A join within one subvolume bridges a gap where some slices have no
 * center; one between two subvolumes belongs to a fiber that turns from one to the other. */
#ifndef SELVEDGE_GEOMETRY_JOINING_H
#define SELVEDGE_GEOMETRY_JOINING_H

#include "base/thread_pool.h"
#include "geometry/fibers/polyline.h"
#include "geometry/volume/volume.h"

#include <stdbool.h>

struct join_counts {
    size_t n_duplicate;             /* number of vertices removed by the last call */
    size_t n_gap_bridged, n_joined; /* summed over calls, so they must start at zero */
};

/* touching: two lines beside each other are one fiber if the distance of their axes, over the sum of their radii, is
 * below this; 0 while radii are not known well. pool NULL: one thread. */
struct duplicate_option {
    size_t n_voxel[3];
    double diameter_voxel, touching;
    struct thread_pool *pool;
};

/* eps_d: density that counts as material. blur_voxel: standard deviation of the edges of fibers, when lines lie on
 * their axes and their radii are known; 0: joins are judged by their shape alone. pool NULL: one thread. */
struct join_option {
    double diameter_voxel, eps_d, blur_voxel;
    struct thread_pool *pool;
};

/* Both steps write to result (initialised, empty); polylines_mark_duplicates marks the vertices that the first removes.
 * min_vertex: pieces that are shorter after the removal of duplicates are
 * dropped. STATUS_NO_MEMORY. */
status polylines_mark_duplicates(const struct polyline_set *lines, const struct duplicate_option *o, bool *mark,
                                 struct error *err);
status polylines_remove_duplicates(const struct polyline_set *lines, const struct duplicate_option *o,
                                   size_t min_vertex, struct polyline_set *result, struct join_counts *counts,
                                   struct error *err);
/* Returns whether another line passes beside vertex i of `line` within `share` of the sum of their radii; the axes of
 * touching fibers are at 1. most: largest radius of a line. */
bool polyline_is_overlapped(const struct polyline_set *p, const struct vertex_grid *g, size_t line, size_t i,
                            float share, float most);
/* Sections of the lines are kept, and interpolated over the gaps. */
status polylines_join(const struct polyline_set *lines, const struct volume *v, const struct join_option *o,
                      struct polyline_set *result, struct join_counts *counts, struct error *err);

#endif
