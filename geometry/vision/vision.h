/* The only door to OpenCV (C++): image filters on single-channel float pictures, row-major, no padding.
 * Every exception is caught inside; OpenCV's own threads are off, so results do not depend on them.
 * Threads: vision_blob_response may be called from several threads at once after vision_init.
 */
#ifndef SELVEDGE_GEOMETRY_VISION_H
#define SELVEDGE_GEOMETRY_VISION_H

#ifdef __cplusplus
extern "C" {
#endif

#include "base/status.h"

/* Switches OpenCV's threads off. Call before threads use the function below; calling again does no harm. */
status vision_init(struct error *err);

/* Scale-normalised Laplacian of Gaussian, sign such that bright blobs are maxima:
 * response = -sigma^2 lap(G_sigma * image), height x width as image is; sigma in pixels, 0.1 to 1000; the picture is mirrored at its borders.
 * STATUS_INVALID, STATUS_NO_MEMORY, STATUS_INTERNAL (OpenCV's own words). */
status vision_blob_response(const float *image, size_t width, size_t height, double sigma, float *response,
                            struct error *err);

#ifdef __cplusplus
}
#endif
#endif
