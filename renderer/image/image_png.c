#include "renderer/image/image.h"

#include <math.h>
#include <png.h>
#include <stdlib.h>
#include <string.h>

static uint8_t srgb_byte(double linear)
{
    double v = linear <= 0.0031308 ? 12.92 * linear : 1.055 * pow(linear, 1 / 2.4) - 0.055;
    if (!(v > 0)) return 0; /* NaN too */
    return v < 1 ? (uint8_t)(255 * v + 0.5) : 255;
}

status image_write_png_rgb8(const uint8_t *rgb, size_t width, size_t height, const char *path, struct error *err)
{
    png_image png;
    memset(&png, 0, sizeof png);
    if (width == 0 || height == 0 || width > 1u << 16 || height > 1u << 16)
        return error_set(err, STATUS_INVALID, "cannot write image '%s': %zu x %zu pixels", path, width, height);
    png.version = PNG_IMAGE_VERSION;
    png.width = (png_uint_32)width;
    png.height = (png_uint_32)height;
    png.format = PNG_FORMAT_RGB;
    if (png_image_write_to_file(&png, path, 0, rgb, 0, NULL)) return STATUS_OK;
    png_image_free(&png);
    return error_set(err, STATUS_IO, "cannot write image '%s': %s", path, png.message);
}

status image_write_png(const struct image *im, double exposure, const char *path, struct error *err)
{
    size_t n = im->width * im->height;
    if (im->n_channel < 3)
        return error_set(err, STATUS_INVALID, "cannot write image '%s': it has %zu channels", path, im->n_channel);
    uint8_t *rgb = malloc(3 * n);
    if (rgb == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write image '%s': out of memory", path);
    for (size_t i = 0; i < n; i++)
        for (size_t c = 0; c < 3; c++) rgb[3 * i + c] = srgb_byte((double)im->pixel[i * im->n_channel + c] * exposure);
    status st = image_write_png_rgb8(rgb, im->width, im->height, path, err);
    free(rgb);
    return st;
}
