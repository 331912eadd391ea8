/* Directions of weft and warp from the repeat of the weave.
 *
 * Twisted fibers show one side of their yarn more than the other, which turns the mean of their directions by up to 2 degrees. The cloth
 * shifted by a repeat along a yarn looks like itself: of the shifts within 6 degrees of a main direction, a quarter to three quarters of the
 * volume long, the one with the largest normalised correlation (of cells 1/128 of the volume wide, 8 in height) gives the direction in the
 * plane, and with cells of 1/128 in height the rise that correlates best gives the tilt. Two passes over the volume, slice by slice. void_value: what cells at VOLUME_OUTSIDE count as.
 */
#ifndef SELVEDGE_GEOMETRY_REPEAT_DIRECTION_H
#define SELVEDGE_GEOMETRY_REPEAT_DIRECTION_H

#include "geometry/orientation/main_directions.h"

/* Where the correlation reaches 0.4 and falls off to both sides, the direction is replaced, and its standard
 * errors become half a cell over the shift; repeat_m and correlation are set. Otherwise the direction stays, and a degree is added to its
 * standard error in quadrature. STATUS_NO_MEMORY. */
status repeat_directions_refine(const struct volume *v, double void_value, struct thread_pool *pool,
                                struct main_directions *m, struct error *err);

#endif
