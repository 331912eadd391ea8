/* Peaks of a picture of responses among those pixels where fibers can be. */
#ifndef SELVEDGE_GEOMETRY_SLICE_PEAKS_H
#define SELVEDGE_GEOMETRY_SLICE_PEAKS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct peak_search {
    const float *response; /* width x height; read only at candidates and their neighbours */
    size_t width, height;
    const uint8_t *candidate; /* pixel_bits.h, (width + 7) / 8 bytes a row */
    float least;              /* least response of a peak */
};

/* Takes a peak. Returns false to end the search. */
typedef bool (*peak_visitor)(void *context, size_t u, size_t v);
/* Visits the peaks row by row: pixels that are higher than their eight neighbours, of equal pixels the first. Returns
 * false if a visitor did. */
bool peaks_visit(const struct peak_search *s, peak_visitor visit, void *context);
/* Offset of the maximum of the paraboloid through the 3 x 3 pixels around a peak, at most one pixel. */
void peak_offset(const struct peak_search *s, size_t u, size_t v, float offset[2]);

#endif
