/* The fibers of a flat cloth as a program draws them close up that cannot trace rays: lines with a radius, how much of
 * the sky each of their points sees, and the light that a fiber scatters once as a table of directions. Light that is
 * scattered more often comes from the tables of appearance_table.h.
 */
#ifndef SELVEDGE_RENDERER_NEAR_FIBERS_H
#define SELVEDGE_RENDERER_NEAR_FIBERS_H

#include "base/thread_pool.h"
#include "renderer/transport/radiance_tracer.h"

enum {
    NEAR_OPEN_EDGE = 8, /* cells of a hemisphere: NEAR_OPEN_EDGE^2 (direction_grid.h) */
    /* a lobe's grid: of the half angle, of the difference angle and of the azimuth */
    NEAR_LOBE_HALF = 64,
    NEAR_LOBE_DIFFERENCE = 12,
    NEAR_LOBE_AZIMUTH = 16,
    NEAR_LOBE_CELLS = NEAR_LOBE_HALF * NEAR_LOBE_DIFFERENCE * NEAR_LOBE_AZIMUTH
};

/* Frame as in scene_ray.h. Fibers lie where their scene has them, so some points lie beyond the tile. */
struct near_point {
    float position_mm[3], radius_mm;
    uint32_t i_set; /* parameter set */
    bool is_last;   /* the next point belongs to another line */
    uint64_t
        open[2]; /* bit `row * NEAR_OPEN_EDGE + column`: the middle of this cell is seen, above from the highest place
                       * of the fiber there, below from the lowest */
};

struct near_fibers {
    size_t n_point, n_set;
    struct near_point *point; /* owned */
    /* Owned; n_set x NEAR_LOBE_AZIMUTH x NEAR_LOBE_DIFFERENCE x NEAR_LOBE_HALF x rgb: S (scattering.h), in the mean of
     * all views of the fiber, at the middles of cells over
     *     azimuth      |ph_i - ph_o| in [0, pi]
     *     difference   (th_o - th_i) / 2 in [-pi/2, pi/2]
     *     half angle   (th_i + th_o) / 2 = sign(x) x^2 pi/2 for x in [-1, 1]: finer about 0, where lobes are narrow */
    float *lobe;
};

/* Lines that no direction of the grid sees are left out, and points of nearly straight runs. If more than most_points
 * remain, lines become coarser; n_point is 0 if that does not suffice. in: as for appearance_table_make. The bits do
 * not depend on the number of threads. STATUS_INVALID as parameter_sets_init, STATUS_NO_MEMORY, STATUS_CANCELLED. */
status near_fibers_make(const struct radiance_input *in, size_t most_points, struct thread_pool *pool,
                        const struct progress *progress, struct near_fibers *f, struct error *err);
void near_fibers_release(struct near_fibers *f);

#endif
