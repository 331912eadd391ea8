/* The C interface to OpenCV's search for a ColorChecker (module mcc of opencv_contrib). All exceptions are caught
 * inside. The search uses fixed random numbers, so the same picture gives the same answer. */
#ifndef SELVEDGE_GEOMETRY_VISION_CHART_H
#define SELVEDGE_GEOMETRY_VISION_CHART_H

#ifdef __cplusplus
extern "C" {
#endif

#include "base/status.h"

/* Finds a ColorChecker Classic in an rgb picture of 8 bits a channel, row-major. corner_px: x, y of the outer corners
 * of the grid of patches, with a margin of a tenth of a patch, in the order of the patches dark skin, bluish green,
 * black, white. STATUS_NOT_FOUND when the picture shows none; STATUS_INVALID, STATUS_NO_MEMORY, STATUS_INTERNAL. */
status vision_find_chart(const unsigned char *rgb, size_t width, size_t height, double corner_px[8], struct error *err);

#ifdef __cplusplus
}
#endif
#endif
