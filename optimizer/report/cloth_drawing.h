/* A drawing of the cloth for reports of jobs that have rendered no picture of it. */
#ifndef SELVEDGE_OPTIMIZER_CLOTH_DRAWING_H
#define SELVEDGE_OPTIMIZER_CLOTH_DRAWING_H

#include "optimizer/report/findings/report.h"

/* Draws the fibers from above, lit from the upper left, with the tile repeated: *width * *height pixels of 3 bytes in
 * sRGB, row 0 at the top, freed by the caller. color: linear rgb of the cloth; the brightest channel is shown at a
 * fixed level, so only its hue counts. STATUS_NO_MEMORY, STATUS_INVALID. */
status cloth_drawing(const struct report *report, const double color[3], uint8_t **rgb, size_t *width, size_t *height,
                     struct error *err);

#endif
