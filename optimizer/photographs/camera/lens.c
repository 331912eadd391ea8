#include "optimizer/photographs/camera/lens.h"

#include <math.h>
#include <string.h>

double lens_vignetting(const struct lens *l, const double real[2])
{
    if (!l->has_vignetting) return 1.0;
    double dx = (real[0] - l->vignetting_center_px[0]) / l->vignetting_radius_px;
    double dy = (real[1] - l->vignetting_center_px[1]) / l->vignetting_radius_px, r = dx * dx + dy * dy;
    return fmax(1.0 + r * (l->vignetting[0] + r * (l->vignetting[1] + r * l->vignetting[2])), 0.01);
}

/* Divides by the share of the light, or of variances by its square. */
static void remove_vignetting(const struct lens *l, bool variances, struct image *im)
{
    for (size_t i = 0; i < im->width * im->height; i++) {
        const double at[2] = {(double)(i % im->width) + 0.5, (double)(i / im->width) + 0.5};
        double share = lens_vignetting(l, at);
        if (variances) share *= share;
        for (size_t c = 0; c < 3; c++) im->pixel[3 * i + c] /= (float)share;
    }
}

void lens_distort(const struct lens *l, const double ideal[2], double real[2])
{
    double x = (ideal[0] - l->center_px[0]) / l->focal_px[0], y = (ideal[1] - l->center_px[1]) / l->focal_px[1];
    double r = x * x + y * y, radial = 1.0 + r * (l->k[0] + r * (l->k[1] + r * l->k[2]));
    real[0] = l->center_px[0] + l->focal_px[0] * (x * radial + 2.0 * l->p[0] * x * y + l->p[1] * (r + 2.0 * x * x));
    real[1] = l->center_px[1] + l->focal_px[1] * (y * radial + l->p[0] * (r + 2.0 * y * y) + 2.0 * l->p[1] * x * y);
}

void lens_undistort(const struct lens *l, const double real[2], double ideal[2])
{
    memcpy(ideal, real, 2 * sizeof *ideal);
    for (int i = 0; i < 30 && l->has_distortion; i++) {
        double back[2];
        lens_distort(l, ideal, back);
        for (size_t c = 0; c < 2; c++) ideal[c] += real[c] - back[c];
        if (fabs(real[0] - back[0]) + fabs(real[1] - back[1]) < 1e-9) break;
    }
}

/* Interpolates at a place in pixels, whose centers are at halves. False outside of the picture. */
static bool sample(const struct image *im, const double at[2], float out[3])
{
    double x = at[0] - 0.5, y = at[1] - 0.5;
    if (!(x >= -0.5 && y >= -0.5 && x <= (double)im->width - 0.5 && y <= (double)im->height - 0.5)) return false;
    x = fmin(fmax(x, 0.0), (double)im->width - 1.0);
    y = fmin(fmax(y, 0.0), (double)im->height - 1.0);
    size_t ix = (size_t)x, iy = (size_t)y, nx = ix + 1 < im->width ? ix + 1 : ix,
           ny = iy + 1 < im->height ? iy + 1 : iy;
    float fx = (float)(x - (double)ix), fy = (float)(y - (double)iy);
    for (size_t c = 0; c < 3; c++) {
        const float *p = im->pixel + c;
        float top = (1.0f - fx) * p[3 * (iy * im->width + ix)] + fx * p[3 * (iy * im->width + nx)];
        float bottom = (1.0f - fx) * p[3 * (ny * im->width + ix)] + fx * p[3 * (ny * im->width + nx)];
        out[c] = (1.0f - fy) * top + fy * bottom;
    }
    return true;
}

static status correct(const struct lens *l, const double crop[4], bool variances, struct image *im, struct error *err)
{
    const double x1 = crop[2] > 0.0 ? crop[2] : (double)im->width, y1 = crop[3] > 0.0 ? crop[3] : (double)im->height;
    struct image out;
    if (x1 > (double)im->width || y1 > (double)im->height)
        return error_set(err, STATUS_INVALID, "the crop ends at (%.0f, %.0f), the picture at (%zu, %zu)", x1, y1,
                         im->width, im->height);
    if (l->has_vignetting) remove_vignetting(l, variances, im);
    status s = image_init(&out, (size_t)fmax(rint(x1 - crop[0]), 1.0), (size_t)fmax(rint(y1 - crop[1]), 1.0), 3, err);
    for (size_t i = 0; s == STATUS_OK && i < out.width * out.height; i++) {
        const double step[2] = {(x1 - crop[0]) / (double)out.width, (y1 - crop[1]) / (double)out.height};
        double ideal[2] = {crop[0] + ((double)(i % out.width) + 0.5) * step[0],
                           crop[1] + ((double)(i / out.width) + 0.5) * step[1]},
               real[2];
        memcpy(real, ideal, sizeof real);
        if (l->has_distortion) lens_distort(l, ideal, real);
        if (!sample(im, real, out.pixel + 3 * i)) {
            s = error_set(err, STATUS_INVALID,
                          "without the distortion of the lens the crop reaches beyond the picture, at (%.0f, %.0f)",
                          ideal[0], ideal[1]);
            image_release(&out);
        }
    }
    if (s != STATUS_OK) return s;
    image_release(im);
    *im = out;
    return STATUS_OK;
}

status lens_correct(const struct lens *l, const double crop[4], struct image *im, struct error *err)
{
    return correct(l, crop, false, im, err);
}

status lens_correct_variance(const struct lens *l, const double crop[4], struct image *variance, struct error *err)
{
    return correct(l, crop, true, variance, err);
}
