/* The distribution of fiber lengths in a cloth by axis class (weft, warp, pile), and a plot of it. */
#ifndef SELVEDGE_OPTIMIZER_FIBER_LENGTHS_H
#define SELVEDGE_OPTIMIZER_FIBER_LENGTHS_H

#include "geometry/fibers/fiber_set.h"

#include <stdio.h>

enum { LENGTH_BINS = 24 };

struct fiber_lengths {
    size_t n[3]; /* fibers of weft, warp, pile */
    double total_m[3];
    double shortest_m, p10_m, median_m, p90_m, longest_m, mean_m;
    double edge_m[LENGTH_BINS + 1]; /* equal bins from 0 to longest_m */
    size_t count[3][LENGTH_BINS];
    double length_in_bin_m[3][LENGTH_BINS];
};

status fiber_lengths_measure(const struct fiber_set *f, struct fiber_lengths *l, struct error *err);
/* Writes an SVG document without inline styles: bars of summed length over fiber length, stacked by class. A line marks
 * tile_m, the larger edge of the tile. */
void fiber_lengths_plot(const struct fiber_lengths *l, double tile_m, FILE *out);

/* A style sheet inside of an SVG picture, which exchanges its colors where the page that shows it is dark. */
#define SVG_DARK_STYLE                                                                                                 \
    "<style>@media (prefers-color-scheme: dark) { svg { fill: #e6e8ec; } [fill=\"#fff\"] { fill: #14171c; } "          \
    "[stroke=\"#ddd\"] { stroke: #3a404a; } [fill=\"#b00\"] { fill: #ff8a80; } [stroke=\"#b00\"] { stroke: #ff8a80; "  \
    "} }</style>\n"

#endif
