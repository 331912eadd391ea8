/* Estimates from a photograph of a woven cloth: the distances and directions of its yarns, the draft, the width of the
 * yarns, the colors of warp and weft, and the contrast of the texture. Each comes with a confidence. These are guesses
 * to start a fit from, not measurements.
 *
 * The photograph looks straight down on flat cloth. Light that changes over the picture, and objects in it, do no harm
 * if most of the picture is cloth. Steps: illumination is made even (vision_flatten); peaks of the spectrum
 * (weave_peaks.h); their lattice (weave_lattice.h); directions of yarns by streaks (weave_streaks.h); the averaged
 * repeat (weave_repeat.h); the draft by synthesis (weave_draft.h).
 *
 * Units: pixels of the photograph, x to the right and y down; degrees. */
#ifndef SELVEDGE_GEOMETRY_WEAVE_DETECT_H
#define SELVEDGE_GEOMETRY_WEAVE_DETECT_H

#include "geometry/weave/weave_guess.h"

/* Analyses one photograph of at least 64 x 64 pixels. STATUS_NOT_FOUND: the photograph shows no texture of two crossing
 * sets of yarns. STATUS_INVALID, STATUS_NO_MEMORY, STATUS_INTERNAL. */
status weave_detect(const struct weave_picture *picture, struct weave_guess *guess, struct error *err);

/* Name of a draft: "plain", "twill 2/1", "satin 5", "basket 2/2" and so on; "draft" for any other. Twills are named
 * over and under by the warp. Writes at most n bytes. */
void weave_draft_name(const struct weave_draft *draft, char *name, size_t n);

#endif
