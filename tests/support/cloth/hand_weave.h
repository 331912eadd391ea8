/* Small fiber sets made by hand, so that renderer tests do not depend on the phantom generator. */
#ifndef SELVEDGE_TESTS_HAND_WEAVE_H
#define SELVEDGE_TESTS_HAND_WEAVE_H

#include "geometry/fibers/fiber_set.h"

struct hand_weave_option {
    size_t n_yarn;                              /* in each direction; even */
    size_t n_strand;                            /* in each yarn */
    size_t n_segment;                           /* in each strand */
    double tile_m, fiber_radius_m, twist_turns; /* twist_turns: in the length of a tile */
};

/* Makes a periodic tile of plain weave. Aborts the test when memory runs out. */
void hand_weave(struct fiber_set *f, const struct hand_weave_option *o);
/* The cloth of the benchmarks: 1,024 strands of 120 segments, radius 16 um, tile 4.45 mm. */
void hand_weave_bench(struct fiber_set *f);
/* A small cloth for tests: 2 x 2 yarns of 12 strands, radius 16 um, tile 0.55 mm. */
void hand_weave_small(struct fiber_set *f);
/* Straight fibers along x at given (y, z), spanning exactly one tile, so that they have no ends. */
void hand_straight(struct fiber_set *f, size_t n, const double (*y_z_m)[2], double tile_m, double radius_m);

#endif
