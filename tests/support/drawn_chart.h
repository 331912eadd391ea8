/* A ColorChecker on its dark board before grey, drawn into a picture as a camera sees it. */
#ifndef SELVEDGE_TESTS_DRAWN_CHART_H
#define SELVEDGE_TESTS_DRAWN_CHART_H

#include "renderer/image/image.h"

/* corner_px: of the patches (color_chart.h). camera: matrix from radiance to camera rgb, which gain multiplies. noise:
 * relative standard deviation of each value. */
void draw_chart(struct image *im, const double corner_px[8], const double camera[9], double gain, double noise);

#endif
