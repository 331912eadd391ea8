/* A photographed ColorChecker Classic: where its patches are, their mean colors, the matrix that follows, and doubts. A
 * chart that lies flat under a lamp at theta has the radiance reflectance times cos theta. The light of the lamp may
 * fall over the chart (chart_fit.h); the scale of the matrix holds at one place, the middle of the chart unless the
 * caller says where the cloth lies. */
#ifndef SELVEDGE_OPTIMIZER_COLOR_CHART_H
#define SELVEDGE_OPTIMIZER_COLOR_CHART_H

#include "base/status.h"
#include "base/warning.h"
#include "optimizer/photographs/camera/chart_fit.h"
#include "optimizer/photographs/camera/chart_reference.h"
#include "renderer/image/image.h"

#include <stdbool.h>

enum { COLOR_CHART_ROWS = 4, COLOR_CHART_COLUMNS = 6 };

struct color_chart {
    bool from_2014;               /* in: the chart was made in November 2014 or later */
    const double (*reference)[3]; /* in: colors of another chart's patches, of the caller; NULL: of a ColorChecker */
    bool found_automatically;
    double corner_px[8]; /* x, y: outer corners of the patches dark skin, bluish green, black, white */
    double measured_rgb[COLOR_CHART_PATCHES][3]; /* means over the middle of each patch */
    double wanted_rgb[COLOR_CHART_PATCHES][3];   /* radiances */
    bool saturated[COLOR_CHART_PATCHES];      /* a part of the middle is, or a channel is cut off at black: not used */
    double scale_at_px[2];                    /* in: where the cloth lies; NaN: the middle of the chart */
    struct chart_fit fit;                     /* the matrix, under the light at scale_at_px */
    bool matrix_used;                         /* false: fit.matrix is one factor for all channels, which fits better */
    double light[COLOR_CHART_PATCHES];        /* on each patch, by fit */
    double light_range;                       /* largest light over the smallest one, less 1 */
    size_t white, worst;                      /* the brightest patch; the patch of the largest delta_e_left_out */
    double patch_var[COLOR_CHART_PATCHES][3]; /* of measured_rgb, by the scatter of the patch's parts */
    /* CIEDE2000 under the fitted light: with one factor for all channels, with the matrix, and with the matrix of the
     * other patches */
    double delta_e_before[COLOR_CHART_PATCHES], delta_e_after[COLOR_CHART_PATCHES],
        delta_e_left_out[COLOR_CHART_PATCHES];
};

/* Finds the chart in a picture of linear values, unless corner_px[0] is a number. STATUS_NOT_FOUND. */
status color_chart_find(const struct image *im, double corner_px[8], bool *found, struct error *err);
/* Measures the patches inside the corners, and fits matrix and light. saturation: value from which on a sample is
 * saturated (INFINITY: none). STATUS_INVALID: a corner outside the picture, a saturated white patch, a place of the
 * scale off the chart, patches that are no chart's (left out in turn they differ by more than 6 in the mean). Warns
 * from a difference of 4 on, of a light that falls by more than 10 %, and of a matrix that is worse than none. */
status color_chart_measure(struct color_chart *k, const struct image *im, double saturation, double light_theta_rad,
                           const struct warning_sink *warn, struct error *err);
/* Means of the three color differences over the patches. */
double color_chart_mean(const double delta_e[COLOR_CHART_PATCHES]);
/* Point (u, v) in [0, 1]^2 of the chart, from dark skin along the rows, in pixels of the photograph. */
void color_chart_place(const double corner_px[8], double u, double v, double at_px[2]);
/* A drawing of the chart: the photograph after the matrix with the wanted color in the middle of each patch, over a
 * brightness of 1. The caller releases it. */
status color_chart_picture(const struct color_chart *k, const struct image *im, struct image *picture,
                           struct error *err);

#endif
