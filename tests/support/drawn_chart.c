#include "tests/support/drawn_chart.h"

#include "base/rng.h"
#include "optimizer/photographs/camera/color_chart.h"
#include "optimizer/photographs/camera/color_matrix.h"

#include <math.h>
#include <string.h>

void draw_chart(struct image *im, const double corner_px[8], const double camera[9], double gain, double noise)
{
    const double margin = 0.045, width = 6 * 2.5 + 5 * 0.25, height = 4 * 2.5 + 3 * 0.25;
    double wanted[24][3];
    for (size_t i = 0; i < 24; i++) color_chart_reference(false, i, wanted[i]);
    for (size_t i = 0; i < im->width * im->height; i++)
        for (size_t c = 0; c < 3; c++) im->pixel[3 * i + c] = (float)(0.35 * gain);
    for (int step = 0; step < 2; step++) /* the board, then the patches */
        for (size_t j = 0; j < 1400 * 900; j++) {
            double u = ((double)(j % 1400) + 0.5) / 1400.0, v = ((double)(j / 1400) + 0.5) / 900.0, at[2],
                   rgb[3] = {0.02, 0.02, 0.02};
            if (step == 0) {
                u = -margin + u * (1.0 + 2.0 * margin);
                v = -1.5 * margin + v * (1.0 + 3.0 * margin);
            } else {
                double x = fmod(u * width, 2.75), y = fmod(v * height, 2.75);
                if (x > 2.5 || y > 2.5) continue;
                memcpy(rgb, wanted[(size_t)(v * height / 2.75) * 6 + (size_t)(u * width / 2.75)], sizeof rgb);
            }
            color_chart_place(corner_px, u, v, at);
            color_matrix_apply(camera, rgb, rgb);
            if (!(at[0] >= 0 && at[1] >= 0 && at[0] < (double)im->width && at[1] < (double)im->height)) continue;
            for (size_t c = 0; c < 3; c++)
                im->pixel[3 * ((size_t)at[1] * im->width + (size_t)at[0]) + c] = (float)(gain * rgb[c]);
        }
    struct rng_key key = {.seed = 3};
    for (size_t i = 0; i < im->width * im->height && noise > 0.0; i++)
        for (uint32_t c = 0; c < 3; c++) {
            struct rng r;
            double z[2];
            rng_start(&r, &key, (uint32_t)i, c);
            rng_normal_pair(&r, z);
            im->pixel[3 * i + c] *= (float)(1.0 + noise * z[0]);
        }
}
