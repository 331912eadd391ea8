#include "geometry/vision/vision_markers.h"

#include <cstring>
#include <opencv2/aruco.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace
{

bool dictionary_of(const char *name, cv::Ptr<cv::aruco::Dictionary> &dictionary)
{
    static const struct {
        const char *name;
        int id;
    } known[] = {{"4x4_50", cv::aruco::DICT_4X4_50},
                 {"5x5_100", cv::aruco::DICT_5X5_100},
                 {"6x6_250", cv::aruco::DICT_6X6_250},
                 {"aruco_original", cv::aruco::DICT_ARUCO_ORIGINAL}};
    for (const auto &k : known)
        if (std::strcmp(k.name, name) == 0) {
            dictionary = cv::aruco::getPredefinedDictionary(k.id);
            return true;
        }
    return false;
}

status unknown_dictionary(const char *name, struct error *err)
{
    return error_set(err, STATUS_INVALID,
                     "'%.40s' is no dictionary of markers: allowed are 4x4_50, 5x5_100, 6x6_250, aruco_original", name);
}

} // namespace

#define CATCH                                                                                                          \
    catch (const std::bad_alloc &) { return error_set(err, STATUS_NO_MEMORY, "cannot use markers: out of memory"); }   \
    catch (const std::exception &e) { return error_set(err, STATUS_INTERNAL, "cannot use markers: %s", e.what()); }    \
    catch (...) { return error_set(err, STATUS_INTERNAL, "cannot use markers: unknown exception"); }

status vision_find_markers(const unsigned char *grey, const size_t size[2], const char *dictionary, bool alone,
                           size_t most, struct vision_marker *marker, size_t *n, struct error *err)
{
    const size_t width = size[0], height = size[1];
    *n = 0;
    if (width < 32 || height < 32 || width > 1u << 20 || height > 1u << 20)
        return error_set(err, STATUS_INVALID, "cannot look for markers in a picture of %zu x %zu pixels", width,
                         height);
    try {
        cv::Ptr<cv::aruco::Dictionary> words;
        if (!dictionary_of(dictionary, words)) return unknown_dictionary(dictionary, err);
        cv::Mat picture(static_cast<int>(height), static_cast<int>(width), CV_8U, const_cast<unsigned char *>(grey));
        cv::Ptr<cv::aruco::DetectorParameters> how = cv::aruco::DetectorParameters::create();
        how->cornerRefinementMethod = alone ? cv::aruco::CORNER_REFINE_SUBPIX : cv::aruco::CORNER_REFINE_NONE;
        std::vector<std::vector<cv::Point2f>> corner;
        std::vector<int> found;
        cv::aruco::detectMarkers(picture, words, corner, found, how);
        for (size_t i = 0; i < found.size() && *n < most; i++, ++*n) {
            marker[*n].id = found[i];
            for (size_t k = 0; k < 4; k++) {
                marker[*n].corner_px[2 * k] = static_cast<double>(corner[i][k].x) + 0.5;
                marker[*n].corner_px[2 * k + 1] = static_cast<double>(corner[i][k].y) + 0.5;
            }
        }
        return STATUS_OK;
    }
    CATCH
}

status vision_refine_corners(const unsigned char *grey, const size_t size[2], size_t half_window_px, size_t n,
                             double (*at_px)[2], struct error *err)
{
    if (n == 0) return STATUS_OK;
    try {
        cv::Mat picture(static_cast<int>(size[1]), static_cast<int>(size[0]), CV_8U, const_cast<unsigned char *>(grey));
        std::vector<cv::Point2f> corner(n);
        for (size_t i = 0; i < n; i++)
            corner[i] = cv::Point2f(static_cast<float>(at_px[i][0] - 0.5), static_cast<float>(at_px[i][1] - 0.5));
        int half = static_cast<int>(half_window_px);
        cv::cornerSubPix(picture, corner, cv::Size(half, half), cv::Size(-1, -1),
                         cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 40, 0.005));
        for (size_t i = 0; i < n; i++) {
            at_px[i][0] = static_cast<double>(corner[i].x) + 0.5;
            at_px[i][1] = static_cast<double>(corner[i].y) + 0.5;
        }
        return STATUS_OK;
    }
    CATCH
}

status vision_draw_marker(const char *dictionary, int id, size_t side, unsigned char *grey, struct error *err)
{
    try {
        cv::Ptr<cv::aruco::Dictionary> words;
        if (!dictionary_of(dictionary, words)) return unknown_dictionary(dictionary, err);
        if (id < 0 || id >= words->bytesList.rows)
            return error_set(err, STATUS_INVALID, "the dictionary '%s' has no marker %d", dictionary, id);
        cv::Mat out(static_cast<int>(side), static_cast<int>(side), CV_8U, grey);
        cv::aruco::drawMarker(words, id, static_cast<int>(side), out, 1);
        return STATUS_OK;
    }
    CATCH
}
