/* How long the fibers of a cloth are, by axis class; and a plot of it. */
#ifndef SELVEDGE_OPTIMIZER_FIBER_LENGTHS_H
#define SELVEDGE_OPTIMIZER_FIBER_LENGTHS_H

#include "geometry/fibers/fiber_set.h"

#include <stdio.h>

enum { LENGTH_BINS = 24 };

struct fiber_lengths {
    size_t n[3]; /* fibers of weft, warp, pile */
    double total_m[3];
    double shortest_m, p10_m, median_m, p90_m, longest_m, mean_m;
    double edge_m[LENGTH_BINS + 1]; /* even steps from 0 to the longest */
    size_t count[3][LENGTH_BINS];
    double length_in_bin_m[3][LENGTH_BINS];
};

status fiber_lengths_measure(const struct fiber_set *f, struct fiber_lengths *l, struct error *err);
/* Bars of summed length, stacked by class, over fiber length; tile_m (larger edge of the tile) is marked. A whole SVG document without inline
 * styles. */
void fiber_lengths_plot(const struct fiber_lengths *l, double tile_m, FILE *out);

#endif
