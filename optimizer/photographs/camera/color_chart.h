/* A photographed ColorChecker Classic: where its patches are, their mean colors, and the matrix that follows.
 *
 * Reference: the CIE L*a*b* values (D50, 2 degrees, M0) that X-Rite published in 2016 ("New color specifications
 * for ColorChecker SG and Classic charts") for charts made before and from November 2014, adapted to D65 by
 * Bradford and expressed as linear sRGB reflectances, 1 for a perfect white. The same numbers are in colour-
 * science 0.4.7 ("ColorChecker24 - Before / After November 2014"), except b* of the earlier blue sky, -21.905
 * there. The white patches of the editions differ by 4 % in luminance, and so does the scale that follows. A chart
 * that lies flat under a lamp at theta has the radiance reflectance times cos theta. */
#ifndef SELVEDGE_OPTIMIZER_COLOR_CHART_H
#define SELVEDGE_OPTIMIZER_COLOR_CHART_H

#include "base/status.h"
#include "renderer/image/image.h"

#include <stdbool.h>

enum { COLOR_CHART_PATCHES = 24, COLOR_CHART_ROWS = 4, COLOR_CHART_COLUMNS = 6, COLOR_CHART_WHITE = 18 };

struct color_chart {
    bool from_2014; /* in: the chart was made in November 2014 or later */
    bool found_automatically;
    double corner_px[8]; /* x, y: outer corners of the patches dark skin, bluish green, black, white */
    double measured_rgb[COLOR_CHART_PATCHES][3]; /* means over the middle of each patch */
    double wanted_rgb[COLOR_CHART_PATCHES][3];   /* radiances */
    bool saturated[COLOR_CHART_PATCHES];         /* a part of the middle is: the patch is not used */
    double matrix[9], matrix_cov[3][9];          /* color_matrix_covariance */
    double patch_var[COLOR_CHART_PATCHES][3];    /* of measured_rgb, by the scatter of the patch's parts */
    double delta_e_before[COLOR_CHART_PATCHES];  /* CIEDE2000, with one factor for all channels, from the white patch */
    double delta_e_after[COLOR_CHART_PATCHES];
};

/* Linear sRGB reflectance of patch i. */
void color_chart_reference(bool from_2014, size_t i, double rgb[3]);
/* Finds the chart in a picture of linear values, unless corner_px[0] is a number. STATUS_NOT_FOUND. */
status color_chart_find(const struct image *im, double corner_px[8], bool *found, struct error *err);
/* Measures the patches inside the corners and fits the matrix. full_scale_is: values from which on a sample is
 * saturated (INFINITY: none). STATUS_INVALID: a corner outside the picture, a saturated white patch, patches that are
 * no chart's (the matrix leaves a mean difference above 12). */
status color_chart_measure(struct color_chart *k, const struct image *im, double saturation, double light_theta_rad,
                           struct error *err);
/* Point (u, v) in [0, 1]^2 of the chart, from dark skin along the rows, in pixels of the photograph. */
void color_chart_place(const double corner_px[8], double u, double v, double at_px[2]);
/* A drawing of the chart: the photograph after the matrix with the wanted color in the middle of each patch, over a
 * brightness of 1. The caller releases it. */
status color_chart_picture(const struct color_chart *k, const struct image *im, struct image *picture,
                           struct error *err);

#endif
