#include "geometry/vision/vision.h"

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace
{

/* Samples the Gaussian and its second derivative times sigma^2, the latter scaled to second moment 2. Their sums are
 * 1 and 0. */
void gaussian_kernels(double sigma, std::vector<float> &smooth, std::vector<float> &second)
{
    int reach = std::max(2, static_cast<int>(std::ceil(4.0 * sigma)));
    std::vector<double> g, d;
    double sum = 0.0, sum_second = 0.0, moment = 0.0;
    for (int i = -reach; i <= reach; i++) {
        double e = std::exp(-0.5 * i * i / (sigma * sigma));
        g.push_back(e);
        sum += e;
    }
    for (int i = -reach; i <= reach; i++) {
        double &e = g[static_cast<size_t>(i + reach)];
        e /= sum;
        d.push_back(e * (i * i / (sigma * sigma) - 1.0));
        sum_second += d.back();
    }
    for (int i = -reach; i <= reach; i++) {
        double &e = d[static_cast<size_t>(i + reach)];
        e -= sum_second * g[static_cast<size_t>(i + reach)];
        moment += e * i * i;
    }
    for (double e : g) smooth.push_back(static_cast<float>(e));
    for (double e : d) second.push_back(static_cast<float>(e * 2.0 / moment));
}

cv::Mat as_matrix(const float *image, size_t width, size_t height)
{
    return cv::Mat(static_cast<int>(height), static_cast<int>(width), CV_32F, const_cast<float *>(image));
}

status bad_size(size_t width, size_t height, double sigma, struct error *err)
{
    return error_set(err, STATUS_INVALID, "cannot filter a picture of %zu x %zu pixels with sigma %g", width, height,
                     sigma);
}

bool size_ok(size_t width, size_t height, double sigma)
{
    return width > 0 && height > 0 && width < 1u << 30 && height < 1u << 30 && sigma > 0.1 && sigma < 1000.0;
}

} // namespace

#define CATCH                                                                                                          \
    catch (const std::bad_alloc &)                                                                                     \
    {                                                                                                                  \
        return error_set(err, STATUS_NO_MEMORY, "cannot filter picture: out of memory");                               \
    }                                                                                                                  \
    catch (const std::exception &e) { return error_set(err, STATUS_INTERNAL, "cannot filter picture: %s", e.what()); } \
    catch (...) { return error_set(err, STATUS_INTERNAL, "cannot filter picture: unknown exception"); }

status vision_init(struct error *err)
{
    try {
        cv::setNumThreads(1);
        return STATUS_OK;
    }
    CATCH
}

status vision_blob_response(const float *image, size_t width, size_t height, double sigma, float *response,
                            struct error *err)
{
    if (!size_ok(width, height, sigma)) return bad_size(width, height, sigma, err);
    try {
        std::vector<float> smooth, second;
        gaussian_kernels(sigma, smooth, second);
        cv::Mat in = as_matrix(image, width, height), out = as_matrix(response, width, height), xx, yy;
        cv::sepFilter2D(in, xx, CV_32F, second, smooth, cv::Point(-1, -1), 0.0, cv::BORDER_REFLECT);
        cv::sepFilter2D(in, yy, CV_32F, smooth, second, cv::Point(-1, -1), 0.0, cv::BORDER_REFLECT);
        cv::addWeighted(xx, -sigma * sigma, yy, -sigma * sigma, 0.0, out);
        return STATUS_OK;
    }
    CATCH
}
