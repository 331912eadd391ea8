#include "optimizer/fit/photographs/photograph.h"

#include "base/files/durable.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

enum { LIMIT_PIXEL = 200 * 1000 * 1000, MAX_BLOCK = 8, MIN_BLOCK_PX = 4 };

static const double saturated_limit = 0.02;
/* Largest standard deviation of sub-block means over the mean without a warning. Cloth at 1 cm has a few per cent; a
 * shadow edge or a wrong crop has much more. */
static const double contrast_limit = 0.35;

static status crop_image(struct image *im, const size_t crop[4], const char *name, struct error *err)
{
    if (crop[2] == 0) return STATUS_OK;
    if (crop[2] > im->width || crop[3] > im->height)
        return error_set(err, STATUS_INVALID,
                         "cannot use photograph '%s': the crop ends at (%zu, %zu), the picture at (%zu, %zu)", name,
                         crop[2], crop[3], im->width, im->height);
    size_t w = crop[2] - crop[0], h = crop[3] - crop[1], n = im->n_channel;
    for (size_t y = 0; y < h; y++)
        memmove(im->pixel + y * w * n, im->pixel + ((y + crop[1]) * im->width + crop[0]) * n, w * n * sizeof(float));
    im->width = w;
    im->height = h;
    return STATUS_OK;
}

static double saturated_part(const struct image *im)
{
    size_t n = im->width * im->height, n_saturated = 0;
    for (size_t i = 0; i < n; i++) {
        const float *p = im->pixel + i * im->n_channel;
        n_saturated += p[0] >= 1.0f || p[1] >= 1.0f || p[2] >= 1.0f;
    }
    return (double)n_saturated / (double)n;
}

status photograph_read(const char *path, const struct job_photograph *p, struct image *im, double *saturated_share,
                       struct error *err)
{
    const char *dot = strrchr(path, '.');
    bool linear = dot != NULL && strcasecmp(dot, ".exr") == 0;
    status s;
    memset(im, 0, sizeof *im);
    if (linear)
        s = image_read_exr(im, path, LIMIT_PIXEL, err);
    else if (dot != NULL && strcasecmp(dot, ".png") == 0)
        s = photograph_read_png(path, p->srgb, LIMIT_PIXEL, im, err);
    else
        return error_set(err, STATUS_UNSUPPORTED, "cannot read photograph '%s': its name must end in .exr or .png",
                         path_file_name(path));
    if (s != STATUS_OK) return s;
    s = crop_image(im, p->crop_px, path_file_name(path), err);
    if (s != STATUS_OK) {
        image_release(im);
        return s;
    }
    if (saturated_share != NULL) *saturated_share = linear ? 0.0 : saturated_part(im);
    for (size_t i = 0; i < im->width * im->height * im->n_channel; i++) im->pixel[i] *= (float)p->scale;
    return STATUS_OK;
}

/* Mean over all pixels, and the scatter of the means of n_block x n_block sub-blocks. */
static void measure_channel(const struct image *im, size_t c, size_t n_block, double *mean, double *block_sd)
{
    double total = 0.0, sum = 0.0, sum2 = 0.0;
    for (size_t by = 0; by < n_block; by++) {
        for (size_t bx = 0; bx < n_block; bx++) {
            size_t x0 = bx * im->width / n_block, x1 = (bx + 1) * im->width / n_block;
            size_t y0 = by * im->height / n_block, y1 = (by + 1) * im->height / n_block;
            double block = 0.0;
            for (size_t y = y0; y < y1; y++)
                for (size_t x = x0; x < x1; x++) block += (double)im->pixel[(y * im->width + x) * im->n_channel + c];
            total += block;
            block /= (double)((x1 - x0) * (y1 - y0));
            sum += block;
            sum2 += block * block;
        }
    }
    double n = (double)(n_block * n_block), block_mean = sum / n;
    *mean = total / (double)(im->width * im->height);
    *block_sd = n > 1.0 ? sqrt(fmax(0.0, (sum2 - n * block_mean * block_mean) / (n - 1.0))) : 0.0;
}

static status check_pixels(const struct image *im, const char *name, struct error *err)
{
    for (size_t i = 0; i < im->width * im->height; i++)
        for (size_t c = 0; c < 3; c++)
            if (!isfinite(im->pixel[i * im->n_channel + c]))
                return error_set(err, STATUS_INVALID,
                                 "cannot use photograph '%s': pixel (%zu, %zu) is not a finite number", name,
                                 i % im->width, i / im->width);
    return STATUS_OK;
}

status photograph_measure(const char *path, const struct job_photograph *p, struct photograph_mean *mean,
                          struct error *err)
{
    const char *name = path_file_name(path);
    struct image im;
    memset(mean, 0, sizeof *mean);
    status s = photograph_read(path, p, &im, &mean->saturated_share, err);
    if (s != STATUS_OK) return s;
    s = check_pixels(&im, name, err);
    if (s != STATUS_OK) goto out;
    size_t side = im.width < im.height ? im.width : im.height, n_block = side / MIN_BLOCK_PX;
    n_block = n_block > MAX_BLOCK ? MAX_BLOCK : n_block < 1 ? 1 : n_block;
    for (size_t c = 0; c < 3; c++) {
        double block_sd;
        measure_channel(&im, c, n_block, &mean->mean_rgb[c], &block_sd);
        mean->se_rgb[c] = block_sd / (double)n_block;
        if (mean->mean_rgb[c] > 0.0) mean->block_contrast = fmax(mean->block_contrast, block_sd / mean->mean_rgb[c]);
    }
    const double *m = mean->mean_rgb;
    if (m[0] < 0.0 || m[1] < 0.0 || m[2] < 0.0)
        s = error_set(err, STATUS_INVALID, "cannot use photograph '%s': its mean rgb (%g, %g, %g) is negative", name,
                      m[0], m[1], m[2]);
    else if (m[0] + m[1] + m[2] <= 0.0)
        s = error_set(err, STATUS_INVALID, "cannot use photograph '%s': it is all black", name);
    else if (mean->saturated_share > saturated_limit)
        s = error_set(err, STATUS_INVALID,
                      "cannot use photograph '%s': %.1f %% of its pixels are saturated, allowed are %.0f %%", name,
                      100.0 * mean->saturated_share, 100.0 * saturated_limit);
    else if (mean->block_contrast > contrast_limit)
        snprintf(
            mean->warning, sizeof mean->warning,
            "photograph '%s' is not uniform: the means of its parts scatter by %.0f %%, so one mean describes it badly",
            name, 100.0 * mean->block_contrast);
out:
    image_release(&im);
    return s;
}
