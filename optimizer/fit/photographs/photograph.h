/* One photograph to its mean rgb radiance.
 *
 * Reads OpenEXR (linear) and 8/16-bit PNG (declared transfer: job_photograph.srgb), takes the crop, multiplies by the
 * photograph's scale. The standard error of the mean comes from the means of square sub-blocks (8 x 8 of them where the
 * crop allows): cloth has texture that is correlated from pixel to pixel, so single pixels would state an error that is
 * far too small. STATUS_FORMAT / STATUS_INVALID naming the file: unreadable, NaN or infinite pixels, negative mean, all
 * black, saturated (more than 2 % of the crop of a PNG at its largest value), crop outside the picture.
 */
#ifndef SELVEDGE_OPTIMIZER_PHOTOGRAPH_H
#define SELVEDGE_OPTIMIZER_PHOTOGRAPH_H

#include "optimizer/job/job_document.h"
#include "renderer/image/image.h"

struct photograph_mean {
    double mean_rgb[3], se_rgb[3];
    double saturated_share; /* of the crop's pixels */
    double block_contrast;  /* standard deviation of sub-block means over the mean, largest channel */
    char warning[400];      /* "" or why the mean describes the crop badly */
};

status photograph_measure(const char *path, const struct job_photograph *p, struct photograph_mean *mean,
                          struct error *err);

/* The crop as an image, scaled to radiance units (for pictures in the report). *saturated_share: of the crop's pixels
 * that have a channel at full scale, 0 for OpenEXR; may be NULL. */
status photograph_read(const char *path, const struct job_photograph *p, struct image *im, double *saturated_share,
                       struct error *err);

/* 8/16-bit PNG, grey or rgb, to linear floats: a channel at its largest value is exactly 1, all others are below. */
status photograph_read_png(const char *path, bool srgb, size_t limit_pixel, struct image *im, struct error *err);

#endif
