#include "optimizer/photographs/reader/float_dng.h"

#include "base/files/durable.h"
#include "optimizer/photographs/reader/exif.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <tiffio.h>

enum { PHOTOMETRIC_RAW_MOSAIC = 32803, PHOTOMETRIC_RAW_RGB = 34892, MOST_FOLDERS = 16, LEAST_COMPRESSION = 64 };

static int drop_message(TIFF *tiff, void *user, const char *module, const char *format, va_list argument)
{
    (void)tiff, (void)user, (void)module, (void)format, (void)argument;
    return 1;
}

static TIFF *open_quietly(const char *path)
{
    TIFFOpenOptions *option = TIFFOpenOptionsAlloc();
    if (option == NULL) return NULL;
    TIFFOpenOptionsSetErrorHandlerExtR(option, drop_message, NULL);
    TIFFOpenOptionsSetWarningHandlerExtR(option, drop_message, NULL);
    TIFF *tiff = TIFFOpenExt(path, "rm", option);
    TIFFOpenOptionsFree(option);
    return tiff;
}

static uint16_t tag_of(TIFF *tiff, uint32_t tag)
{
    uint16_t value = 0;
    return TIFFGetFieldDefaulted(tiff, tag, &value) ? value : 0;
}

static bool is_float_picture(TIFF *tiff)
{
    const uint16_t photometric = tag_of(tiff, TIFFTAG_PHOTOMETRIC);
    return (photometric == PHOTOMETRIC_RAW_MOSAIC || photometric == PHOTOMETRIC_RAW_RGB) &&
           tag_of(tiff, TIFFTAG_SAMPLEFORMAT) == SAMPLEFORMAT_IEEEFP;
}

/* Goes to the folder of the picture: the first one, or a folder inside of it where that is a preview. */
static bool find_picture(TIFF *tiff)
{
    uint16_t n = 0;
    uint64_t *inner = NULL, at[MOST_FOLDERS];
    if (is_float_picture(tiff)) return true;
    if (!TIFFGetField(tiff, TIFFTAG_SUBIFD, &n, &inner) || inner == NULL) return false;
    n = n < MOST_FOLDERS ? n : MOST_FOLDERS;
    memcpy(at, inner, n * sizeof *at);
    for (uint16_t i = 0; i < n; i++)
        if (TIFFSetSubDirectory(tiff, at[i]) == 1 && is_float_picture(tiff)) return true;
    return false;
}

/* Black and white level of a channel. */
static void take_levels(TIFF *tiff, size_t c, double *black, double *white)
{
    uint16_t n = 0;
    float *real = NULL;
    uint32_t *whole = NULL;
    *black = 0.0;
    *white = 1.0;
    if (TIFFGetField(tiff, TIFFTAG_BLACKLEVEL, &n, &real) && n > 0 && real != NULL)
        *black = (double)real[n == 3 ? c : 0];
    if (TIFFGetField(tiff, TIFFTAG_WHITELEVEL, &n, &whole) && n > 0 && whole != NULL) *white = whole[n == 3 ? c : 0];
}

/* Copies n_x pixels of a row to (x, y). */
static void put_row(const uint8_t *row, size_t n_x, size_t x, size_t y, struct image *im)
{
    memcpy(im->pixel + 3 * (y * im->width + x), row, 3 * n_x * sizeof(float));
}

static bool read_samples(TIFF *tiff, uint8_t *piece, struct image *im)
{
    uint32_t width = 0, height = 0;
    if (!TIFFIsTiled(tiff)) {
        for (uint32_t y = 0; y < im->height; y++) {
            if (TIFFReadScanline(tiff, piece, y, 0) != 1) return false;
            put_row(piece, im->width, 0, y, im);
        }
        return true;
    }
    TIFFGetField(tiff, TIFFTAG_TILEWIDTH, &width);
    TIFFGetField(tiff, TIFFTAG_TILELENGTH, &height);
    const size_t row_bytes = (size_t)TIFFTileRowSize(tiff);
    for (uint32_t y = 0; y < im->height; y += height)
        for (uint32_t x = 0; x < im->width; x += width) {
            if (TIFFReadTile(tiff, piece, x, y, 0, 0) < 0) return false;
            for (uint32_t i = 0; i < height && y + i < im->height; i++)
                put_row(piece + i * row_bytes, width < im->width - x ? width : im->width - x, x, y + i, im);
        }
    return true;
}

/* Returns the bytes of a row or tile; 0 for sizes that no picture of this limit has. */
static uint64_t piece_bytes(TIFF *tiff, size_t limit_pixel)
{
    uint32_t width = 0, height = 0;
    if (!TIFFIsTiled(tiff)) return TIFFScanlineSize64(tiff);
    TIFFGetField(tiff, TIFFTAG_TILEWIDTH, &width);
    TIFFGetField(tiff, TIFFTAG_TILELENGTH, &height);
    return width == 0 || height == 0 || width > limit_pixel / height ? 0 : TIFFTileSize64(tiff);
}

static status check(TIFF *tiff, const char *path, const struct photograph_request *q, uint32_t *width, uint32_t *height,
                    struct error *err)
{
    const char *name = path_file_name(path);
    struct stat file;
    if (tag_of(tiff, TIFFTAG_PHOTOMETRIC) != PHOTOMETRIC_RAW_RGB || tag_of(tiff, TIFFTAG_SAMPLESPERPIXEL) != 3 ||
        tag_of(tiff, TIFFTAG_BITSPERSAMPLE) != 32 || tag_of(tiff, TIFFTAG_PLANARCONFIG) != PLANARCONFIG_CONTIG)
        return error_set(err, STATUS_UNSUPPORTED,
                         "cannot read photograph '%s': it is a DNG of floating point samples that are not rgb of 32 "
                         "bits: save it as OpenEXR",
                         name);
    TIFFGetField(tiff, TIFFTAG_IMAGEWIDTH, width);
    TIFFGetField(tiff, TIFFTAG_IMAGELENGTH, height);
    if (*width == 0 || *height == 0 || *width > q->limit_pixel / *height)
        return error_set(err, STATUS_TOO_LARGE, "cannot read photograph '%s': %u x %u pixels, the limit is %zu in all",
                         name, *width, *height, q->limit_pixel);
    if (stat(path, &file) != 0) return error_set_errno(err, "cannot read photograph '%s'", name);
    if (piece_bytes(tiff, q->limit_pixel) == 0 ||
        (uint64_t)*width * *height / LEAST_COMPRESSION > (uint64_t)file.st_size)
        return error_set(err, STATUS_FORMAT,
                         "cannot read photograph '%s': its header promises %u x %u pixels, the file has %lld bytes",
                         name, *width, *height, (long long)file.st_size);
    return STATUS_OK;
}

static status scale(TIFF *tiff, const char *path, const struct photograph_request *q, struct image *im,
                    struct photograph_info *info, struct error *err)
{
    for (size_t c = 0; c < 3; c++) {
        double black, white;
        take_levels(tiff, c, &black, &white);
        if (c == 0)
            file_ledger_add(&info->ledger, "black level", isnan(q->black_level) ? NULL : "the document gives one", "%g",
                            black);
        if (c == 0) file_ledger_add(&info->ledger, "white level", NULL, "%g", white);
        if (!isnan(q->black_level)) black = q->black_level;
        if (!(white > black))
            return error_set(err, STATUS_INVALID,
                             "cannot use photograph '%s': its black level %g is not below its white level %g",
                             path_file_name(path), black, white);
        if (c == 0) info->black_level = black;
        for (size_t i = c; i < 3 * im->width * im->height; i += 3)
            im->pixel[i] = (float)(((double)im->pixel[i] - black) / (white - black));
        info->saturation[c] = 1.0;
    }
    return STATUS_OK;
}

static status read_picture(TIFF *tiff, const char *path, const struct photograph_request *q, struct image *im,
                           struct photograph_info *info, struct error *err)
{
    uint32_t width = 0, height = 0;
    status s = check(tiff, path, q, &width, &height, err);
    if (s == STATUS_OK) s = image_init(im, width, height, 3, err);
    if (s != STATUS_OK) return s;
    uint8_t *piece = malloc((size_t)piece_bytes(tiff, q->limit_pixel) + 12 * (size_t)width);
    if (piece == NULL)
        s = error_set(err, STATUS_NO_MEMORY, "cannot read photograph '%s': out of memory", path_file_name(path));
    else if (!read_samples(tiff, piece, im))
        s = error_set(err, STATUS_FORMAT, "cannot read photograph '%s': damaged data", path_file_name(path));
    free(piece);
    if (s == STATUS_OK) s = scale(tiff, path, q, im, info, err);
    if (s != STATUS_OK) image_release(im);
    return s;
}

status float_dng_read(const char *path, const struct photograph_request *q, struct image *im,
                      struct photograph_info *info, struct error *err)
{
    TIFF *tiff = open_quietly(path);
    if (tiff == NULL) return STATUS_NOT_FOUND;
    status s = find_picture(tiff) ? read_picture(tiff, path, q, im, info, err) : STATUS_NOT_FOUND;
    TIFFClose(tiff);
    FILE *file = s == STATUS_OK ? fopen(path, "rbe") : NULL;
    if (file != NULL) {
        exif_read(file, info);
        fclose(file);
    }
    if (s == STATUS_OK) info->bits = 32;
    return s;
}
