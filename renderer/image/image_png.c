#include "renderer/image/image.h"

#include <errno.h>
#include <math.h>
#include <png.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

uint8_t image_srgb_byte(double linear)
{
    double v = linear <= 0.0031308 ? 12.92 * linear : 1.055 * pow(linear, 1 / 2.4) - 0.055;
    if (!(v > 0)) return 0; /* NaN too */
    return v < 1 ? (uint8_t)(255 * v + 0.5) : 255;
}

/* Not by png_image_write_to_file, whose message does not say that a disk is full. */
static status write_file(png_image *png, const uint8_t *rgb, const char *path, struct error *err)
{
    FILE *f = fopen(path, "wb");
    if (f == NULL) return error_set_errno(err, "cannot write image '%s'", path);
    errno = 0;
    bool ok = png_image_write_to_stdio(png, f, 0, rgb, 0, NULL) != 0 && fflush(f) == 0;
    int cause = errno;
    if (fclose(f) != 0 && ok) {
        ok = false;
        cause = errno;
    }
    if (ok) return STATUS_OK;
    png_image_free(png);
    unlink(path);
    errno = cause;
    return cause != 0 ? error_set_errno(err, "cannot write image '%s'", path)
                      : error_set(err, STATUS_IO, "cannot write image '%s': %s", path, png->message);
}

static status describe(png_image *png, size_t width, size_t height, const char *name, struct error *err)
{
    memset(png, 0, sizeof *png);
    if (width == 0 || height == 0 || width > 1u << 16 || height > 1u << 16)
        return error_set(err, STATUS_INVALID, "cannot write image '%s': %zu x %zu pixels", name, width, height);
    png->version = PNG_IMAGE_VERSION;
    png->width = (png_uint_32)width;
    png->height = (png_uint_32)height;
    png->format = PNG_FORMAT_RGB;
    return STATUS_OK;
}

status image_write_png_rgb8(const uint8_t *rgb, size_t width, size_t height, const char *path, struct error *err)
{
    png_image png;
    status s = describe(&png, width, height, path, err);
    return s == STATUS_OK ? write_file(&png, rgb, path, err) : s;
}

status image_png_bytes(const uint8_t *pixel, size_t width, size_t height, size_t n_channel, uint8_t **bytes,
                       size_t *n_byte, struct error *err)
{
    png_image png;
    png_alloc_size_t n = 0;
    *bytes = NULL;
    status s = describe(&png, width, height, "in memory", err);
    if (s != STATUS_OK) return s;
    png.format = n_channel == 4 ? PNG_FORMAT_RGBA : PNG_FORMAT_RGB;
    n = PNG_IMAGE_PNG_SIZE_MAX(png);
    *bytes = malloc(n);
    if (*bytes != NULL && png_image_write_to_memory(&png, *bytes, &n, 0, pixel, 0, NULL) != 0) {
        *n_byte = n;
        return STATUS_OK;
    }
    png_image_free(&png);
    free(*bytes);
    *bytes = NULL;
    return error_set(err, STATUS_NO_MEMORY, "cannot make a PNG image: out of memory");
}

status image_write_png(const struct image *im, double exposure, const char *path, struct error *err)
{
    size_t n = im->width * im->height;
    if (im->n_channel < 3)
        return error_set(err, STATUS_INVALID, "cannot write image '%s': it has %zu channels", path, im->n_channel);
    uint8_t *rgb = malloc(3 * n);
    if (rgb == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write image '%s': out of memory", path);
    for (size_t i = 0; i < n; i++)
        for (size_t c = 0; c < 3; c++)
            rgb[3 * i + c] = image_srgb_byte((double)im->pixel[i * im->n_channel + c] * exposure);
    status st = image_write_png_rgb8(rgb, im->width, im->height, path, err);
    free(rgb);
    return st;
}
