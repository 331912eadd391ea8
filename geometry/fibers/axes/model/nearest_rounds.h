/* How long the claims of voxels serve: lines at rest keep theirs for some rounds of a fit, while no step moves them
 * far. Lines in tows that the scan does not resolve never rest, so that theirs are found anew in each round. */
#ifndef SELVEDGE_GEOMETRY_CLAIM_ROUNDS_H
#define SELVEDGE_GEOMETRY_CLAIM_ROUNDS_H

#include "geometry/fibers/polyline.h"

#include <stdbool.h>

struct claim_rounds {
    int n_round;        /* that used the present claims; 0: none are kept */
    float (*before)[3]; /* vertices before the last step; NULL: no claims are kept */
    double moved;       /* voxels, root of the mean square of the last step of all vertices */
};

/* Reuse of the nearest segments of voxels between rounds. follows: this round uses the nearest segments of an earlier
 * one; is_followed: the next round may use the nearest segments of this one. */
struct round_kind {
    bool follows, is_followed;
};

/* Begins a fit of lines at rest with n_vertex vertices. A struct of zeros keeps no claims. False: out of memory. */
bool claim_rounds_start(struct claim_rounds *r, size_t n_vertex);
void claim_rounds_release(struct claim_rounds *r);
/* The kind of the next round; is_last: none comes after it. */
struct round_kind claim_rounds_next(struct claim_rounds *r, bool is_last);
/* To be called before and after the step of a round. */
void claim_rounds_before_step(struct claim_rounds *r, const struct polyline_set *lines);
void claim_rounds_after_step(struct claim_rounds *r, const struct polyline_set *lines);

#endif
