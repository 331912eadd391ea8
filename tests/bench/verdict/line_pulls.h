/* Errors of reconstructed fibers over the errors that are stated of them. */
#ifndef SELVEDGE_TESTS_LINE_PULLS_H
#define SELVEDGE_TESTS_LINE_PULLS_H

#include "geometry/fibers/fiber_set.h"
#include "geometry/grade/reconstruct_report.h"

/* An error over its standard error. */
struct pull {
    double robust; /* median of its absolute value, over that of a normal variable */
    double rms;
    double covered; /* share below 2; 0.954 of a normal variable */
};

/* Only of places of found fibers within the radius of a true one, at least margin_m from the faces of the tile in x and
 * y, and not beyond the ends of the true one. NaN: there are none, or no error is stated. */
struct line_pulls {
    struct pull position;     /* both components across the true fiber */
    struct pull radius;       /* mean radius of a found fiber, if half of its vertices are such places */
    struct pull point_radius; /* radius at a vertex */
};

/* The truth has the tile's size. STATUS_NO_MEMORY. */
status line_pulls_measure(const struct fiber_set *truth, const struct fiber_set *found,
                          const struct reconstruct_report *report, double margin_m, struct line_pulls *out,
                          struct error *err);

#endif
