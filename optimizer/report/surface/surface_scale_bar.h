/* A bar of a stated length in the lower left corner of a picture for the eye. */
#ifndef SELVEDGE_OPTIMIZER_SURFACE_SCALE_BAR_H
#define SELVEDGE_OPTIMIZER_SURFACE_SCALE_BAR_H

#include <stddef.h>
#include <stdint.h>

/* Draws a bar over about a quarter of the width, a power of ten times 1, 2 or 5, with its length below. rgb: 3 bytes a
 * pixel, px x px, row 0 at the top. Pictures of fewer than 128 pixels stay as they are. */
void surface_scale_bar_draw(uint8_t *rgb, size_t px, double width_mm);

#endif
