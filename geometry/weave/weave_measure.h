/* Measures yarns in the averaged repeat once the draft is known: their width and their colors. */
#ifndef SELVEDGE_GEOMETRY_WEAVE_MEASURE_H
#define SELVEDGE_GEOMETRY_WEAVE_MEASURE_H

#include "geometry/weave/weave_contrast.h"
#include "geometry/weave/weave_guess.h"

/* Fills cover, warp, weft and their confidences. draft and repeat are in pixels of this picture.
 *
 * Width: the brightness across a yarn where it is on top, as the average over all its floats, is taken as the
 * brightness of a cylinder under even light, sqrt(1 - (2 x / width)^2). Its half height is 0.87 of the width. Colors:
 * the averaged repeat of each channel, in the middle of the crossings where warp or weft is on top. Both confidences
 * grow with the number of pixels in a yarn's distance: below 3 pixels nothing is known, above 12 all that the picture
 * can tell. STATUS_NO_MEMORY, STATUS_INTERNAL. */
status weave_measure_yarns(const struct weave_picture *picture, const struct weave_draft *draft,
                           const struct weave_repeat *repeat, struct weave_guess *guess, struct error *err);

#endif
