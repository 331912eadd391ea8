/* One pair of yarn frequencies tried on a repeat: the repeat in the coordinates of these yarns, and how likely such
 * yarns are before the picture is looked at. */
#ifndef SELVEDGE_GEOMETRY_WEAVE_TRIAL_H
#define SELVEDGE_GEOMETRY_WEAVE_TRIAL_H

#include "geometry/weave/weave_drawing.h"
#include "geometry/weave/weave_repeat.h"
#include "geometry/weave/weave_streaks.h"

/* WEAVE_PLACES: steps of the origin within one crossing, along each set of yarns. WEAVE_BLURS: blurs of the drawing. */
enum { WEAVE_PLACES = 8, WEAVE_BLURS = 5 };

struct weave_trial {
    struct weave_cells cells;
    double f_warp[2], f_weft[2]; /* cycles per pixel */
    double prior;                /* logarithm */
    size_t n;                    /* coefficients */
    struct weave_strokes stroke[WEAVE_COEFFICIENT_MAX];
    double weight[WEAVE_COEFFICIENT_MAX];
    double blur[WEAVE_BLURS][WEAVE_COEFFICIENT_MAX]; /* factors of the drawing's coefficients */
    /* The repeat's coefficients with the origin at each place, real and imaginary parts. */
    double moved_re[WEAVE_COEFFICIENT_MAX][WEAVE_PLACES * WEAVE_PLACES];
    double moved_im[WEAVE_COEFFICIENT_MAX][WEAVE_PLACES * WEAVE_PLACES];
    double power, n_effective; /* weighted power of all coefficients, and how many of them matter */
};

/* warp, weft: yarn frequencies as whole-number combinations of the lattice's basis. Returns false if they cannot belong
 * to warp (the more vertical yarns) and weft. */
bool weave_trial_init(struct weave_trial *t, const struct weave_lattice *lattice, const struct weave_repeat *repeat,
                      const struct weave_streaks *streaks, const int warp[2], const int weft[2]);

/* Logarithm of how likely a draft (bit patterns as in weave_drawing.h) is on these yarns before the picture is seen. */
double weave_trial_draft_prior(const struct weave_trial *t, unsigned pattern);

#endif
