/* How long the nearest segments of voxels serve: for lines at rest they are reused for some rounds of a fit, while no
 * step moves the lines far. Lines in tows that the scan does not resolve never rest: there they are found anew in each
 * round. */
#ifndef SELVEDGE_GEOMETRY_NEAREST_ROUNDS_H
#define SELVEDGE_GEOMETRY_NEAREST_ROUNDS_H

#include "geometry/fibers/polyline.h"

#include <stdbool.h>

struct nearest_rounds {
    int n_round;        /* that used the present nearest segments; 0: none are cached */
    float (*before)[3]; /* vertices before the last step; NULL: nothing is cached */
    double moved;       /* voxels, root of the mean square of the last step of all vertices */
};

/* Reuse of the nearest segments of voxels between rounds. follows: this round uses the nearest segments of an earlier
 * one; is_followed: the next round may use the nearest segments of this one. */
struct round_kind {
    bool follows, is_followed;
};

/* Begins a fit of lines at rest with n_vertex vertices. A struct of zeros caches nothing. False: out of memory. */
bool nearest_rounds_start(struct nearest_rounds *r, size_t n_vertex);
void nearest_rounds_release(struct nearest_rounds *r);
/* The kind of the next round; is_last: none comes after it. */
struct round_kind nearest_rounds_next(struct nearest_rounds *r, bool is_last);
/* To be called before and after the step of a round. */
void nearest_rounds_before_step(struct nearest_rounds *r, const struct polyline_set *lines);
void nearest_rounds_after_step(struct nearest_rounds *r, const struct polyline_set *lines);

#endif
