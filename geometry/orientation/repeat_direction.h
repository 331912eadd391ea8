/* Directions of weft and warp from the repeat of the weave.
 *
 * Twisted fibers show one side of their yarn more than the other, which rotates the mean of their directions by up
 * to 2 degrees. A cloth shifted by a repeat along a yarn correlates with itself. The shifts tried lie within 6
 * degrees of a main direction and are a quarter to three quarters of the volume long. The one with the largest
 * normalised correlation, of cells 1/128 of the volume wide and 8 of them in height, gives the direction in the
 * plane. With cells of 1/128 in height the rise that correlates best gives the tilt. The volume is read twice, slice
 * by slice. void_value: value used for voxels at VOLUME_OUTSIDE. */
#ifndef SELVEDGE_GEOMETRY_REPEAT_DIRECTION_H
#define SELVEDGE_GEOMETRY_REPEAT_DIRECTION_H

#include "geometry/orientation/main_directions.h"

/* Replaces a direction if the correlation reaches 0.4 and falls off to both sides; its standard errors become half a
 * cell over the length of the shift, and repeat_m and correlation are set. Otherwise the direction stays, and one
 * degree is added to its standard error in quadrature. STATUS_NO_MEMORY. */
status repeat_directions_refine(const struct volume *v, double void_value, struct thread_pool *pool,
                                struct main_directions *m, struct error *err);

#endif
