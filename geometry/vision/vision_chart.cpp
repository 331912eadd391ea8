#include "geometry/vision/vision_chart.h"

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/mcc.hpp>

namespace
{

/* The search takes pictures of this edge at most: larger ones take minutes, and patches stay large enough. */
constexpr double largest_edge_px = 1500.0;

/* OpenCV's search collects its candidates in the order in which its threads end, and the chart that it reports depends
 * on that order (corners differ by up to 2 % of the chart). One thread gives the same chart every time. */
class OneThread
{
  public:
    OneThread() : threads(cv::getNumThreads()) { cv::setNumThreads(1); }
    ~OneThread() { cv::setNumThreads(threads); }
    OneThread(const OneThread &) = delete;
    OneThread &operator=(const OneThread &) = delete;

  private:
    int threads;
};

} // namespace

status vision_find_chart(const unsigned char *rgb, size_t width, size_t height, double corner_px[8], struct error *err)
{
    if (width < 32 || height < 32 || width > 1u << 20 || height > 1u << 20)
        return error_set(err, STATUS_INVALID, "cannot look for a color chart in a picture of %zu x %zu pixels", width,
                         height);
    try {
        cv::Mat picture(static_cast<int>(height), static_cast<int>(width), CV_8UC3, const_cast<unsigned char *>(rgb));
        cv::Mat small;
        cv::cvtColor(picture, small, cv::COLOR_RGB2BGR);
        double factor = std::min(1.0, largest_edge_px / static_cast<double>(std::max(width, height)));
        if (factor < 1.0) cv::resize(small, small, cv::Size(), factor, factor, cv::INTER_AREA);
        OneThread one_thread;
        cv::setRNGSeed(1);
        cv::Ptr<cv::mcc::CCheckerDetector> detector = cv::mcc::CCheckerDetector::create();
        if (!detector->process(small, cv::mcc::MCC24, 1) || detector->getBestColorChecker().empty())
            return error_set(err, STATUS_NOT_FOUND, "the picture shows no ColorChecker of 24 patches");
        std::vector<cv::Point2f> box = detector->getBestColorChecker()->getBox();
        if (box.size() != 4) return error_set(err, STATUS_NOT_FOUND, "the picture shows no ColorChecker of 24 patches");
        for (size_t i = 0; i < 4; i++) { /* centers of pixels are at whole numbers there, at halves here */
            corner_px[2 * i] = (static_cast<double>(box[i].x) + 0.5) / factor;
            corner_px[2 * i + 1] = (static_cast<double>(box[i].y) + 0.5) / factor;
        }
        return STATUS_OK;
    } catch (const std::bad_alloc &) {
        return error_set(err, STATUS_NO_MEMORY, "cannot look for a color chart: out of memory");
    } catch (const std::exception &e) {
        return error_set(err, STATUS_INTERNAL, "cannot look for a color chart: %s", e.what());
    } catch (...) {
        return error_set(err, STATUS_INTERNAL, "cannot look for a color chart: unknown exception");
    }
}
