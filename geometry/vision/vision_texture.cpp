#include "geometry/vision/vision_texture.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace
{

cv::Mat view_of(const float *image, size_t width, size_t height)
{
    return cv::Mat(static_cast<int>(height), static_cast<int>(width), CV_32F, const_cast<float *>(image));
}

bool has_size(size_t width, size_t height) { return width > 1 && height > 1 && width < 1u << 15 && height < 1u << 15; }

status bad_picture(size_t width, size_t height, struct error *err)
{
    return error_set(err, STATUS_INVALID, "cannot analyse the texture of a picture of %zu x %zu pixels", width, height);
}

/* |DFT|^2 of the windowed picture over the window's energy, with the frequency zero in the middle. */
cv::Mat centred_power(const cv::Mat &flat)
{
    cv::Mat window, transform, part[2], power, centred(flat.size(), CV_32F);
    cv::createHanningWindow(window, flat.size(), CV_32F);
    cv::dft(flat.mul(window), transform, cv::DFT_COMPLEX_OUTPUT);
    cv::split(transform, part);
    power = part[0].mul(part[0]) + part[1].mul(part[1]);
    power *= 1.0 / cv::sum(window.mul(window))[0];
    for (int y = 0; y < flat.rows; y++)
        for (int x = 0; x < flat.cols; x++)
            centred.at<float>((y + flat.rows / 2) % flat.rows, (x + flat.cols / 2) % flat.cols) = power.at<float>(y, x);
    return centred;
}

} // namespace

#define CATCH                                                                                                          \
    catch (const std::bad_alloc &)                                                                                     \
    {                                                                                                                  \
        return error_set(err, STATUS_NO_MEMORY, "cannot analyse texture: out of memory");                              \
    }                                                                                                                  \
    catch (const std::exception &e)                                                                                    \
    {                                                                                                                  \
        return error_set(err, STATUS_INTERNAL, "cannot analyse texture: %s", e.what());                                \
    }                                                                                                                  \
    catch (...) { return error_set(err, STATUS_INTERNAL, "cannot analyse texture: unknown exception"); }

status vision_flatten(const float *grey, size_t width, size_t height, double sigma_px, float *flat, struct error *err)
{
    if (!has_size(width, height) || !(sigma_px >= 0.5 && sigma_px <= 1000.0)) return bad_picture(width, height, err);
    try {
        cv::Mat in = view_of(grey, width, height), out = view_of(flat, width, height), mean, deviation, sd;
        cv::GaussianBlur(in, mean, cv::Size(), sigma_px, sigma_px, cv::BORDER_REFLECT);
        deviation = in - mean;
        cv::GaussianBlur(deviation.mul(deviation), sd, cv::Size(), sigma_px, sigma_px, cv::BORDER_REFLECT);
        cv::sqrt(sd, sd);
        double least = std::max(1e-5 * cv::norm(in, cv::NORM_INF), 1e-30);
        cv::max(sd, least, sd);
        cv::divide(deviation, sd, deviation);
        cv::min(deviation, 3.0, deviation);
        cv::max(deviation, -3.0, out);
        return STATUS_OK;
    }
    CATCH
}

status vision_smooth(const float *grey, size_t width, size_t height, double sigma_px, float *smooth, struct error *err)
{
    if (!has_size(width, height) || !(sigma_px > 0.0 && sigma_px <= 1000.0)) return bad_picture(width, height, err);
    try {
        cv::Mat in = view_of(grey, width, height), out = view_of(smooth, width, height);
        cv::GaussianBlur(in, out, cv::Size(), sigma_px, sigma_px, cv::BORDER_REFLECT);
        return STATUS_OK;
    }
    CATCH
}

status vision_spectrum(const float *flat, size_t width, size_t height, float *power, float *background,
                       struct error *err)
{
    if (!has_size(width, height)) return bad_picture(width, height, err);
    try {
        cv::Mat out = view_of(power, width, height), around = view_of(background, width, height), logarithm;
        cv::GaussianBlur(centred_power(view_of(flat, width, height)), out, cv::Size(5, 5), 1.0);
        cv::log(out + 1e-12, logarithm);
        int edge = std::max(5, static_cast<int>(std::min(width, height) / 12) | 1);
        cv::blur(logarithm, logarithm, cv::Size(edge, edge));
        cv::exp(logarithm, around);
        return STATUS_OK;
    }
    CATCH
}
