/* Pictures of `selvedge photo`: a photograph with its crop. */
#include "optimizer/tools/camera/camera_commands.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* Draws the outline of the crop in red, two pixels wide or more in large pictures. */
static void draw_crop(struct image *im, const size_t crop[4], float bright)
{
    size_t wide = 1 + im->width / 400;
    for (size_t y = 0; y < im->height; y++)
        for (size_t x = 0; x < im->width; x++) {
            bool in = x >= crop[0] && x < crop[2] && y >= crop[1] && y < crop[3];
            bool inner = x >= crop[0] + wide && x + wide < crop[2] && y >= crop[1] + wide && y + wide < crop[3];
            float *p = im->pixel + 3 * (y * im->width + x);
            if (in && !inner) p[0] = bright, p[1] = p[2] = 0.0f;
        }
}

static void draw_line(struct image *im, const double from[2], const double to[2], float bright)
{
    const double length = hypot(to[0] - from[0], to[1] - from[1]);
    for (double at = 0.0; at <= length; at += 0.5) {
        const double share = length > 0.0 ? at / length : 0.0, x = from[0] + share * (to[0] - from[0]),
                     y = from[1] + share * (to[1] - from[1]);
        if (!(x >= 0.0 && y >= 0.0 && x < (double)im->width && y < (double)im->height)) continue;
        float *p = im->pixel + 3 * ((size_t)y * im->width + (size_t)x);
        p[0] = bright, p[1] = p[2] = 0.0f;
    }
}

static int compare_float(const void *a, const void *b)
{
    float x, y;
    memcpy(&x, a, sizeof x);
    memcpy(&y, b, sizeof y);
    return x < y ? -1 : x > y;
}

/* The 99th percentile of the values, which is white in pictures. */
static float white_of(const struct image *im)
{
    enum { N = 4096 };
    float value[N];
    const size_t n = im->width * im->height * 3;
    for (size_t i = 0; i < N; i++) value[i] = im->pixel[(size_t)((double)i / N * (double)n)];
    qsort(value, N, sizeof *value, compare_float);
    return fmaxf(value[N * 99 / 100], 1e-30f);
}

status camera_write_picture(struct image *im, const size_t crop_px[4], const char *out, struct error *err)
{
    const size_t all[4] = {0, 0, im->width, im->height};
    const float bright = white_of(im);
    draw_crop(im, crop_px[2] > 0 ? crop_px : all, bright);
    return image_write_png(im, 1.0 / (double)bright, out, err);
}

status camera_write_columns(struct image *im, const struct job_photograph *column, size_t n, const char *out,
                            struct error *err)
{
    const float bright = white_of(im);
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < 4; k++)
            draw_line(im, column[i].column.corner_px[k], column[i].column.corner_px[(k + 1) % 4], bright);
    return image_write_png(im, 1.0 / (double)bright, out, err);
}
