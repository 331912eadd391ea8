/* The C interface to OpenCV's square markers (module aruco of opencv_contrib). All exceptions are caught inside. */
#ifndef SELVEDGE_GEOMETRY_VISION_MARKERS_H
#define SELVEDGE_GEOMETRY_VISION_MARKERS_H

#ifdef __cplusplus
extern "C" {
#endif

#include "base/status.h"

#include <stdbool.h>

struct vision_marker {
    int id;
    double corner_px[8]; /* x, y of the four corners, clockwise in the drawing from its upper left one */
};

/* Finds the markers of a dictionary ("4x4_50", "5x5_100", "6x6_250", "aruco_original") in a grey picture of 8
 * bits, row-major. At most `most` of them are kept, *n is their number. The center of the first pixel is at 0.5,
 * 0.5. alone: nothing else is near them, so that their corners can be found exactly; beside the squares of a
 * chessboard they cannot. STATUS_INVALID for an unknown dictionary, STATUS_NO_MEMORY, STATUS_INTERNAL. */
status vision_find_markers(const unsigned char *grey, const size_t size[2], const char *dictionary, bool alone,
                           size_t most, struct vision_marker *marker, size_t *n, struct error *err);
/* Moves the n corners of a chessboard (x, y in at_px, as above) to where the picture has them, within half_window_px
 * pixels. A corner that is not found there stays. Errors as above. */
status vision_refine_corners(const unsigned char *grey, const size_t size[2], size_t half_window_px, size_t n,
                             double (*at_px)[2], struct error *err);
/* Draws a marker of side x side pixels, black on white, without a margin. Errors as above, and STATUS_INVALID for an id
 * that the dictionary has not. */
status vision_draw_marker(const char *dictionary, int id, size_t side, unsigned char *grey, struct error *err);

#ifdef __cplusplus
}
#endif
#endif
