/* The draft of a weave, from the averaged repeat of a photograph, by synthesis: every possible draft of every possible
 * pair of yarn frequencies is drawn with few free brightnesses (weave_drawing.h), and the one that resembles the repeat
 * most is taken. This works also where single yarns are narrower than two pixels and cannot be seen on their own.
 *
 * The warp is the set of yarns that is nearer to vertical in the picture; a photograph cannot tell which set was the
 * warp on the loom. */
#ifndef SELVEDGE_GEOMETRY_WEAVE_DRAFT_H
#define SELVEDGE_GEOMETRY_WEAVE_DRAFT_H

#include "geometry/weave/weave_drawing.h"
#include "geometry/weave/weave_repeat.h"
#include "geometry/weave/weave_streaks.h"

#include <stdbool.h>
#include <stdint.h>

struct weave_draft {
    double f_warp[2], f_weft[2]; /* cycles per pixel: one cycle from a warp (weft) to the next */
    double step_warp_px[2];      /* from a warp to the next, to the right, along the wefts */
    double step_weft_px[2];      /* from a weft to the next, down, along the warps */
    size_t n_warp, n_weft;       /* of the smallest rectangle of yarns that repeats */
    /* 1: warp on top. Row k, n_warp values, is weft k, downwards; column i is warp i, to the right. */
    uint8_t warp_on_top[WEAVE_CELL_MAX * WEAVE_CELL_MAX];
    double origin_px[2]; /* the crossing of warp 0 and weft 0 in the averaged repeat */
    double residual;     /* share of the repeat's power that the drawing does not explain */
    /* Logarithm of the odds up to a constant: of this draft, of the best one with the same yarns and another draft, and
     * of the best one with other yarns. -INFINITY: there is none. */
    double score, score_other_draft, score_other_yarns;
    double score_exchanged; /* the same for a plain weave with warp and weft exchanged at every crossing */
};

/* Searches all drafts of up to WEAVE_CELL_MAX crossings that differ, on yarns that cross at 75 to 105 degrees and are
 * at most 3.2 times denser one way. *draft holds the best of the lattices before, and on entry the score -INFINITY
 * before the first; bonus is added to the scores of this lattice. If nothing fits, *draft stays as it is.
 * STATUS_NO_MEMORY. */
status weave_search_draft(const struct weave_lattice *lattice, const struct weave_repeat *repeat,
                          const struct weave_streaks *streaks, double bonus, struct weave_draft *draft,
                          struct error *err);

/* Whether two drafts are the same but for where they begin. */
bool weave_draft_same(const struct weave_draft *a, const struct weave_draft *b);

#endif
