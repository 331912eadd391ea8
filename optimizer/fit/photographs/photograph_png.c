/* 8/16-bit PNG through libpng. Its longjmp stays in this file. */
#include "base/files/durable.h"
#include "optimizer/fit/photographs/photograph.h"

#include <math.h>
#include <png.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

struct png_failure {
    char text[160];
};

static void on_error(png_structp png, png_const_charp text)
{
    struct png_failure *f = png_get_error_ptr(png);
    snprintf(f->text, sizeof f->text, "%s", text);
    png_longjmp(png, 1);
}

static void on_warning(png_structp png, png_const_charp text)
{
    (void)png;
    (void)text;
}

static float to_linear(unsigned value, unsigned largest, bool srgb)
{
    double v = (double)value / (double)largest;
    if (!srgb) return (float)v;
    return (float)(v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4));
}

static void convert(png_structp png, png_infop info, bool srgb, struct image *im)
{
    png_bytepp row = png_get_rows(png, info);
    unsigned depth = png_get_bit_depth(png, info), largest = depth == 16 ? 65535 : 255;
    for (size_t y = 0; y < im->height; y++) {
        for (size_t x = 0; x < im->width; x++) {
            for (size_t c = 0; c < 3; c++) {
                const png_byte *p = row[y] + (3 * x + c) * (depth / 8);
                unsigned v = depth == 16 ? (unsigned)p[0] << 8 | p[1] : p[0];
                im->pixel[(y * im->width + x) * 3 + c] = to_linear(v, largest, srgb);
            }
        }
    }
}

/* Checks the size, which is at bytes 16..23, before libpng allocates memory for it. */
static status check_size(FILE *f, const char *name, size_t limit_pixel, struct error *err)
{
    unsigned char h[24];
    static const unsigned char signature[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
    if (fread(h, 1, sizeof h, f) != sizeof h || memcmp(h, signature, sizeof signature) != 0)
        return error_set(err, STATUS_FORMAT, "cannot read photograph '%s': it is not a PNG file", name);
    size_t width = (size_t)h[16] << 24 | (size_t)h[17] << 16 | (size_t)h[18] << 8 | h[19];
    size_t height = (size_t)h[20] << 24 | (size_t)h[21] << 16 | (size_t)h[22] << 8 | h[23];
    if (width > 0 && height > limit_pixel / width)
        return error_set(err, STATUS_TOO_LARGE,
                         "cannot read photograph '%s': %zu x %zu pixels, the limit is %zu in all", name, width, height,
                         limit_pixel);
    struct stat st; /* a row has at least a bit a pixel; deflate cannot do better than 1 : 1032 */
    if (fstat(fileno(f), &st) != 0) return error_set_errno(err, "cannot read photograph '%s'", name);
    if ((width / 8 + 1) * height / 1100 > (size_t)st.st_size)
        return error_set(err, STATUS_FORMAT,
                         "cannot read photograph '%s': its header promises %zu x %zu pixels, the file has %lld bytes",
                         name, width, height, (long long)st.st_size);
    rewind(f);
    return STATUS_OK;
}

status photograph_read_png(const char *path, bool srgb, size_t limit_pixel, struct image *im, struct error *err)
{
    const char *name = path_file_name(path);
    struct png_failure failure = {{0}};
    memset(im, 0, sizeof *im);
    FILE *f = fopen(path, "rbe");
    if (f == NULL) return error_set_errno(err, "cannot read photograph '%s'", name);
    status s = check_size(f, name, limit_pixel, err);
    if (s != STATUS_OK) {
        fclose(f);
        return s;
    }
    png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &failure, on_error, on_warning);
    png_infop info = png != NULL ? png_create_info_struct(png) : NULL;
    if (info == NULL) {
        s = error_set(err, STATUS_NO_MEMORY, "cannot read photograph '%s': out of memory", name);
    } else if (setjmp(png_jmpbuf(png))) {
        s = error_set(err, STATUS_FORMAT, "cannot read photograph '%s': %s", name, failure.text);
    } else {
        png_init_io(png, f);
        png_read_png(
            png, info,
            PNG_TRANSFORM_EXPAND | PNG_TRANSFORM_STRIP_ALPHA | PNG_TRANSFORM_PACKING | PNG_TRANSFORM_GRAY_TO_RGB, NULL);
        s = image_init(im, png_get_image_width(png, info), png_get_image_height(png, info), 3, err);
        if (s == STATUS_OK) convert(png, info, srgb, im);
    }
    if (png != NULL) png_destroy_read_struct(&png, info != NULL ? &info : NULL, NULL);
    fclose(f);
    return s;
}
