/* A column of a photograph of a cylinder as a picture of its own, with the axis upwards. */
#ifndef SELVEDGE_OPTIMIZER_COLUMN_PICTURE_H
#define SELVEDGE_OPTIMIZER_COLUMN_PICTURE_H

#include "base/status.h"
#include "renderer/image/image.h"

#include <stddef.h>

/* The smallest crop x0, y0, x1, y1 that holds the corners and a pixel beside them, within the limits; x1 and y1 are
 * excluded. */
void column_picture_crop(const double corner_px[4][2], const size_t limit[4], size_t crop[4]);
/* Replaces im, whose upper left corner is at origin_px, by the area between the corners (upper left, upper right, lower
 * right, lower left), by bilinear interpolation at about as many pixels as it covers. Variances of pixels are values as
 * well: their sum over an area stays. Pixels beyond the picture take its nearest one. place_px: where the samples of
 * each channel lie in a pixel, from its middle: the colors of a mosaic, taken as if they lay there, would come from
 * columns beside each other, and a highlight would be red on one side and blue on the other. STATUS_NO_MEMORY. */
status column_picture_cut(const double corner_px[4][2], const size_t origin_px[2], const double place_px[3][2],
                          struct image *im, struct error *err);

#endif
