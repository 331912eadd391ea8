/* The C interface to OpenCV (C++): image filters on single-channel float pictures, row-major, without padding. All
 * exceptions are caught inside. OpenCV's own threads are off, so results do not depend on them. After vision_init,
 * vision_blob_response may be called from several threads at once. */
#ifndef SELVEDGE_GEOMETRY_VISION_H
#define SELVEDGE_GEOMETRY_VISION_H

#ifdef __cplusplus
extern "C" {
#endif

#include "base/status.h"

/* Turns OpenCV's threads off. To be called before the function below; further calls have no effect. STATUS_INTERNAL. */
status vision_init(struct error *err);

/* Scale-normalised Laplacian of Gaussian, with the sign that makes bright blobs maxima: response = -sigma^2
 * lap(G_sigma * image), height x width like image. sigma: in pixels, 0.1 to 1000. The picture is mirrored at its
 * borders. STATUS_INVALID, STATUS_NO_MEMORY, STATUS_INTERNAL (with OpenCV's message). */
status vision_blob_response(const float *image, size_t width, size_t height, double sigma, float *response,
                            struct error *err);

#ifdef __cplusplus
}
#endif
#endif
