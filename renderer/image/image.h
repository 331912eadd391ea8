/* Float images and their files. Row 0 is the top. rgb, 3 floats a pixel, linear, radiance units. */
#ifndef SELVEDGE_RENDERER_IMAGE_H
#define SELVEDGE_RENDERER_IMAGE_H

#include "base/status.h"

#include <stdint.h>

struct image {
    size_t width, height, n_channel; /* n_channel planes interleaved: 3 for rgb, more with named layers */
    float *pixel;                    /* height x width x n_channel */
    const char *const
        *channel_name;  /* EXR names, e.g. "R", "G", "B", "var.R", "d_beta_R.R"; static or owned by the caller */
    void *name_storage; /* NULL, or the memory behind channel_name when the image owns it (render.h) */
};

/* Zero pixels. n_channel == 3 gets the names R, G, B; otherwise channel_name is NULL until the caller sets it. */
status image_init(struct image *im, size_t width, size_t height, size_t n_channel, struct error *err);
void image_release(struct image *im);

/* OpenEXR scan-line file, 32-bit float, uncompressed, through OpenEXRCore. */
status image_write_exr(const struct image *im, const char *path, struct error *err);
/* Reads R, G, B (or Y, copied to all three) of half or float, scan-line or single-level tiled, into n_channel = 3, and
 * turns the primaries that the file states into Rec. 709 (color_primaries.h; image_exr.h reads them as they are).
 * STATUS_FORMAT naming file and reason for missing channels, deep data, truncation; at most limit_pixel pixels
 * (STATUS_TOO_LARGE). */
status image_read_exr(struct image *im, const char *path, size_t limit_pixel, struct error *err);
/* The same for the variances of the pixels' means, channels var.R, var.G and var.B of a rendering. */
status image_read_exr_variance(struct image *im, const char *path, size_t limit_pixel, struct error *err);
/* The same for the layer of a filtered view, channels filtered.R, filtered.G and filtered.B. */
status image_read_exr_filtered(struct image *im, const char *path, size_t limit_pixel, struct error *err);
/* 8-bit sRGB PNG of rgb * exposure. */
status image_write_png(const struct image *im, double exposure, const char *path, struct error *err);
/* 8-bit rgb bytes straight to PNG. */
status image_write_png_rgb8(const uint8_t *rgb, size_t width, size_t height, const char *path, struct error *err);
/* The bytes of such a file, of 3 channels or, with a share of coverage, of 4; the caller frees them. STATUS_INVALID for
 * a size that PNG does not have here, STATUS_NO_MEMORY. */
status image_png_bytes(const uint8_t *pixel, size_t width, size_t height, size_t n_channel, uint8_t **bytes,
                       size_t *n_byte, struct error *err);
/* The byte of the sRGB curve for a linear value; NaN and negative values give 0. */
uint8_t image_srgb_byte(double linear);

#endif
