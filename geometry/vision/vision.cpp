#include "geometry/vision/vision.h"

#include <opencv2/core.hpp>

status vision_init(struct error *err)
{
    try {
        cv::setNumThreads(1);
        return STATUS_OK;
    } catch (const std::exception &e) {
        return error_set(err, STATUS_INTERNAL, "cannot prepare OpenCV: %s", e.what());
    } catch (...) {
        return error_set(err, STATUS_INTERNAL, "cannot prepare OpenCV: unknown exception");
    }
}
