/* A picture of a detected weave over its photograph, to be judged by eye. */
#ifndef SELVEDGE_OPTIMIZER_WEAVE_OVERLAY_H
#define SELVEDGE_OPTIMIZER_WEAVE_OVERLAY_H

#include "geometry/weave/weave_detect.h"

/* Writes a PNG of two pieces of the middle of the photograph side by side, enlarged and with more contrast: the left
 * one bare, the right one with a ring around each crossing where the rarer set of yarns is on top (orange: the warp,
 * blue: the weft), the lines through the middles of the wefts, and the lines of the warps where these are more than 12
 * enlarged pixels apart. */
status weave_overlay_write(const struct weave_picture *picture, const struct weave_guess *guess, const char *path,
                           struct error *err);

#endif
