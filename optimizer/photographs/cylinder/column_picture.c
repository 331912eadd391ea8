#include "optimizer/photographs/cylinder/column_picture.h"

#include <math.h>

void column_picture_crop(const double corner_px[4][2], const size_t limit[4], size_t crop[4])
{
    for (size_t a = 0; a < 2; a++) {
        double least = INFINITY, most = -INFINITY;
        for (size_t i = 0; i < 4; i++) {
            least = fmin(least, corner_px[i][a]);
            most = fmax(most, corner_px[i][a]);
        }
        const double from = (double)limit[a], to = (double)limit[2 + a];
        crop[a] = (size_t)fmin(fmax(floor(least) - 1.0, from), to - 1.0);
        crop[2 + a] = (size_t)fmax(fmin(ceil(most) + 1.0, to), (double)crop[a] + 1.0);
    }
}

/* Channel c at a place of the picture. */
static float sample(const struct image *im, double x, double y, size_t c)
{
    x = fmin(fmax(x - 0.5, 0.0), (double)im->width - 1.0);
    y = fmin(fmax(y - 0.5, 0.0), (double)im->height - 1.0);
    const size_t ix = (size_t)x, iy = (size_t)y, nx = ix + 1 < im->width ? ix + 1 : ix,
                 ny = iy + 1 < im->height ? iy + 1 : iy;
    const float fx = (float)(x - (double)ix), fy = (float)(y - (double)iy), *p = im->pixel + c;
    const float top = (1.0f - fx) * p[3 * (iy * im->width + ix)] + fx * p[3 * (iy * im->width + nx)];
    const float bottom = (1.0f - fx) * p[3 * (ny * im->width + ix)] + fx * p[3 * (ny * im->width + nx)];
    return (1.0f - fy) * top + fy * bottom;
}

static double apart(const double a[2], const double b[2]) { return hypot(a[0] - b[0], a[1] - b[1]); }

status column_picture_cut(const double corner[4][2], const size_t origin_px[2], const double place_px[3][2],
                          struct image *im, struct error *err)
{
    struct image out;
    const double width = 0.5 * (apart(corner[0], corner[1]) + apart(corner[3], corner[2])),
                 height = 0.5 * (apart(corner[0], corner[3]) + apart(corner[1], corner[2]));
    status s = image_init(&out, (size_t)fmax(rint(width), 1.0), (size_t)fmax(rint(height), 1.0), 3, err);
    if (s != STATUS_OK) return s;
    for (size_t i = 0; i < out.width * out.height; i++) {
        const double a = ((double)(i % out.width) + 0.5) / (double)out.width,
                     b = ((double)(i / out.width) + 0.5) / (double)out.height;
        double at[2];
        for (size_t k = 0; k < 2; k++)
            at[k] = (1.0 - b) * ((1.0 - a) * corner[0][k] + a * corner[1][k]) +
                    b * ((1.0 - a) * corner[3][k] + a * corner[2][k]) - (double)origin_px[k];
        for (size_t c = 0; c < 3; c++)
            out.pixel[3 * i + c] = sample(im, at[0] - place_px[c][0], at[1] - place_px[c][1], c);
    }
    image_release(im);
    *im = out;
    return STATUS_OK;
}
