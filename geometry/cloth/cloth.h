/* The procedural cloth: fibers of one periodic tile made from a description (base/catalogue/cloth_description.h) and a
 * vector of its numbers.
 *
 * The fibers move smoothly with every number, so that a search over numbers sees a smooth objective: random numbers
 * are a function of (seed, yarn, fiber) alone, nothing is rounded to voxels or whole turns, and the counts of fibers
 * and of vertices per fiber follow from the description, not from the vector. The tile closes without rounded twists
 * because each fiber is a staple: it starts at a random place, runs along its yarn for one length of the tile and ends,
 * and its images in the neighbouring tiles begin where it ends. A section therefore always holds the same number of
 * fibers. Hairs and mixed fibers appear one after the other by growing from length 0.
 *
 * Yarn model after Zhao et al. 2016, "Fitting procedural yarn models for realistic cloth rendering" (section 3: plies,
 * twist, migration, hairs). Differences: fibers fill the section evenly (golden-angle spiral, Vogel 1979), and a
 * flattened yarn turns more slowly so that its fibers keep their angle on the flat side (README.md). */
#ifndef SELVEDGE_GEOMETRY_CLOTH_H
#define SELVEDGE_GEOMETRY_CLOTH_H

#include "base/catalogue/cloth_description.h"
#include "base/thread_pool.h"
#include "geometry/fibers/fiber_set.h"

_Static_assert((int)CLOTH_MAX_GROUP == (int)FIBER_MAX_GROUP, "each film has a group of its own");

struct cloth_report {
    double tile_m[2];
    size_t n_yarn[2];                    /* wefts and warps; courses and wales; 0 of a felt */
    double yarn_spacing_m[2];            /* mean along x (of warps) and y (of wefts) */
    double yarn_width_m[CLOTH_MAX_KIND]; /* as designed, before yarns press each other; 0 without yarns */
    double yarn_height_m[CLOTH_MAX_KIND];
    double surface_angle_rad[CLOTH_MAX_KIND]; /* between the yarn and its outermost fibers, from the twist */
    double thickness_m;                       /* from the lowest to the highest fiber surface, hairs included */
    double body_thickness_m;                  /* the same without hairs: the reading of a gauge that does not press */
    double cover;                             /* share of the tile's area under at least one fiber, along z */
    double volume_fraction; /* volume of the fibers, hairs included, over tile area x thickness without hairs */
    double overlap_mean;    /* depth of interpenetration over the diameter, mean over all points */
    double overlap_max;
    double strain_p95; /* of bent fibers: radius over radius of curvature; 95 % of the points stay below */
    /* Fibers of each kind in the tile, as pieces between faces, and then of each group of films. */
    size_t n_fiber[FIBER_MAX_GROUP];
    double length_m[FIBER_MAX_GROUP];
};

/* Makes the fibers of d, which has passed cloth_description_check, at the values number[d->n_number] in the units of
 * files (NULL: the values of d). f must be initialised; its content is replaced. axis_class: 0 weft, 1 warp, 2 pile;
 * group: kind of yarn; films follow (cloth_film_group), which push fibers aside and stay where they are. The lowest
 * fiber surface is at z = 0. report: NULL saves the time to measure it. The result does not depend on the number of
 * threads; pool and progress may be NULL. STATUS_INVALID, with err->field naming the number, for values outside of the
 * catalogue's range and for those that contradict each other (a crimp that yarns cannot bend to, threads that have no
 * room); STATUS_TOO_LARGE for more than 20 million vertices; STATUS_NO_MEMORY, STATUS_CANCELLED. */
status cloth_build(const struct cloth_description *d, const double *number, struct thread_pool *pool,
                   const struct progress *progress, struct fiber_set *f, struct cloth_report *report,
                   struct error *err);

#endif
