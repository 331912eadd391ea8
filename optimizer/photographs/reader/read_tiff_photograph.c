/* TIFF through libtiff: float samples are linear; 8- and 16-bit samples need a declared curve. Grey or rgb, in strips,
 * interleaved or in planes; the first page counts, and more pages are an error. */
#include "base/files/durable.h"
#include "geometry/volume/format/tiff_page.h"
#include "optimizer/photographs/reader/exif.h"
#include "optimizer/photographs/reader/integer_samples.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <tiffio.h>

struct tiff_photograph {
    TIFF *tiff;
    const char *path, *name;
    struct tiff_page page; /* width: of all channels, so that its sizes agree with the file's */
    uint32_t width, height;
    uint16_t n_channel, planar, photometric;
    char message[256];
};

static bool recognise(const uint8_t b[PHOTOGRAPH_FIRST_BYTES])
{
    return memcmp(b, "II*\0", 4) == 0 || memcmp(b, "MM\0*", 4) == 0 || memcmp(b, "II+\0", 4) == 0 ||
           memcmp(b, "MM\0+", 4) == 0;
}

static int keep_message(TIFF *tiff, void *user, const char *module, const char *format, va_list argument)
{
    struct tiff_photograph *t = user;
    (void)tiff, (void)module;
    if (t->message[0] != '\0') return 1;
    vsnprintf(t->message, sizeof t->message, format, argument);
    size_t n = strlen(t->path);
    if (strncmp(t->message, t->path, n) == 0 && strncmp(t->message + n, ": ", 2) == 0)
        memmove(t->message, t->message + n + 2, strlen(t->message + n + 2) + 1);
    return 1;
}

static int drop_message(TIFF *tiff, void *user, const char *module, const char *format, va_list argument)
{
    (void)tiff, (void)user, (void)module, (void)format, (void)argument;
    return 1;
}

static status open_tiff(struct tiff_photograph *t, struct error *err)
{
    TIFFOpenOptions *option = TIFFOpenOptionsAlloc();
    if (option == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read photograph '%s': out of memory", t->name);
    TIFFOpenOptionsSetErrorHandlerExtR(option, keep_message, t);
    TIFFOpenOptionsSetWarningHandlerExtR(option, drop_message, t);
    t->tiff = TIFFOpenExt(t->path, "rm", option); /* m: no memory map, which a short file would make raise SIGBUS */
    TIFFOpenOptionsFree(option);
    if (t->tiff != NULL) return STATUS_OK;
    return error_set(err, STATUS_FORMAT, "cannot read photograph '%s': %s", t->name,
                     t->message[0] != '\0' ? t->message : "damaged data");
}

/* Checks that the picture is of a kind that photographs have. */
static status check_kind(const struct tiff_photograph *t, uint16_t format, struct error *err)
{
    if (t->photometric == PHOTOMETRIC_PALETTE) return integer_samples_palette(t->path, err);
    bool rgb = t->photometric == PHOTOMETRIC_RGB && (t->n_channel == 3 || t->n_channel == 4);
    bool grey = t->photometric == PHOTOMETRIC_MINISBLACK && t->n_channel <= 2;
    if (!rgb && !grey)
        return error_set(err, STATUS_UNSUPPORTED,
                         "cannot use photograph '%s': a TIFF of %u channels with PhotometricInterpretation %u; allowed "
                         "are grey and rgb",
                         t->name, t->n_channel, t->photometric);
    bool integer = format == SAMPLEFORMAT_UINT && (t->page.bits == 8 || t->page.bits == 16);
    bool real = format == SAMPLEFORMAT_IEEEFP && t->page.bits == 32;
    if (!integer && !real)
        return error_set(err, STATUS_UNSUPPORTED,
                         "cannot use photograph '%s': it has %u-bit samples of an unsupported kind; allowed are 8 and "
                         "16 bit without sign, and 32-bit float",
                         t->name, t->page.bits);
    if (TIFFIsTiled(t->tiff))
        return error_set(err, STATUS_UNSUPPORTED,
                         "cannot use photograph '%s': it is a tiled TIFF: save it in strips, as is usual", t->name);
    if (!TIFFLastDirectory(t->tiff))
        return error_set(err, STATUS_UNSUPPORTED,
                         "cannot use photograph '%s': it has more than one page: a photograph is one picture", t->name);
    return STATUS_OK;
}

static status read_header(struct tiff_photograph *t, const struct photograph_request *q, struct error *err)
{
    uint16_t format = SAMPLEFORMAT_UINT;
    t->page = (struct tiff_page){.bits = 1, .compression = COMPRESSION_NONE};
    t->photometric = PHOTOMETRIC_MINISBLACK;
    TIFFGetField(t->tiff, TIFFTAG_IMAGEWIDTH, &t->width);
    TIFFGetField(t->tiff, TIFFTAG_IMAGELENGTH, &t->height);
    TIFFGetFieldDefaulted(t->tiff, TIFFTAG_BITSPERSAMPLE, &t->page.bits);
    TIFFGetFieldDefaulted(t->tiff, TIFFTAG_SAMPLEFORMAT, &format);
    TIFFGetFieldDefaulted(t->tiff, TIFFTAG_SAMPLESPERPIXEL, &t->n_channel);
    TIFFGetFieldDefaulted(t->tiff, TIFFTAG_PLANARCONFIG, &t->planar);
    TIFFGetField(t->tiff, TIFFTAG_PHOTOMETRIC, &t->photometric);
    TIFFGetFieldDefaulted(t->tiff, TIFFTAG_COMPRESSION, &t->page.compression);
    status s = check_kind(t, format, err);
    if (s != STATUS_OK) return s;
    if (t->width == 0 || t->height == 0 || t->width > q->limit_pixel || t->height > q->limit_pixel / t->width)
        return error_set(err, STATUS_TOO_LARGE, "cannot read photograph '%s': %u x %u pixels, the limit is %zu in all",
                         t->name, t->width, t->height, q->limit_pixel);
    struct stat st;
    if (fstat(TIFFFileno(t->tiff), &st) != 0) return error_set_errno(err, "cannot read photograph '%s'", t->name);
    t->page.sample = format == SAMPLEFORMAT_IEEEFP ? SAMPLE_FLOAT32 : t->page.bits == 8 ? SAMPLE_UINT8 : SAMPLE_UINT16;
    t->page.width = t->width * t->n_channel;
    t->page.height = t->height;
    if (TIFFScanlineSize(t->tiff) <= 0 || !tiff_page_fits(t->tiff, &t->page, (uint64_t)st.st_size))
        return error_set(err, STATUS_FORMAT,
                         "cannot read photograph '%s': it states %u x %u pixels, but the file is too short for them",
                         t->name, t->width, t->height);
    return STATUS_OK;
}

static void take_metadata(const struct tiff_photograph *t, struct photograph_info *info)
{
    FILE *file = fopen(t->path, "rbe");
    if (file == NULL) return;
    exif_read(file, info);
    fclose(file);
}

/* Sample i of a row as light; alpha: as stored. */
static float sample(const struct tiff_photograph *t, const float *light, const uint8_t *row, size_t i)
{
    float value;
    uint16_t number;
    if (t->page.sample == SAMPLE_UINT8) return light[row[i]];
    if (t->page.sample == SAMPLE_UINT16) {
        memcpy(&number, row + 2 * i, sizeof number);
        return light[number];
    }
    memcpy(&value, row + 4 * i, sizeof value);
    return value;
}

/* Takes one row of samples: of all channels, or of channel i_plane where channels are stored one after the other. */
static status take_row(const struct tiff_photograph *t, const float *light, const uint8_t *row, size_t y,
                       size_t i_plane, struct image *im, struct error *err)
{
    bool planes = t->planar == PLANARCONFIG_SEPARATE;
    size_t n_color = t->n_channel <= 2 ? 1 : 3, stride = planes ? 1 : t->n_channel;
    size_t first = planes ? i_plane : 0, end = planes ? i_plane + 1 : t->n_channel;
    for (size_t c = first; c < end; c++)
        for (size_t x = 0; x < t->width; x++) {
            float v = sample(t, light, row, x * stride + (planes ? 0 : c)), *pixel = im->pixel + (y * t->width + x) * 3;
            if (c >= n_color) {
                if (v < 1.0f) return integer_samples_transparent(t->path, err);
            } else if (n_color == 1) {
                pixel[0] = pixel[1] = pixel[2] = v;
            } else {
                pixel[c] = v;
            }
        }
    return STATUS_OK;
}

static status read_rows(struct tiff_photograph *t, const float *light, struct image *im, struct error *err)
{
    size_t n_plane = t->planar == PLANARCONFIG_SEPARATE ? t->n_channel : 1;
    uint8_t *row = malloc((size_t)TIFFScanlineSize(t->tiff) + (size_t)t->page.width * 4);
    status s = row != NULL ? STATUS_OK
                           : error_set(err, STATUS_NO_MEMORY, "cannot read photograph '%s': out of memory", t->name);
    for (size_t c = 0; c < n_plane && s == STATUS_OK; c++)
        for (uint32_t y = 0; y < t->height && s == STATUS_OK; y++)
            s = TIFFReadScanline(t->tiff, row, y, (uint16_t)c) == 1
                    ? take_row(t, light, row, y, c, im, err)
                    : error_set(err, STATUS_FORMAT, "cannot read photograph '%s': %s", t->name,
                                t->message[0] != '\0' ? t->message : "damaged data");
    free(row);
    return s;
}

static status declare(const struct tiff_photograph *t, const struct photograph_request *q, struct photograph_info *info,
                      struct error *err)
{
    info->has_alpha = t->n_channel == 2 || t->n_channel == 4;
    if (t->page.sample != SAMPLE_FLOAT32) return integer_samples_declare(t->path, q, t->page.bits, info, err);
    info->bits = 32;
    info->black_level = isnan(q->black_level) ? 0.0 : q->black_level;
    return STATUS_OK;
}

static status decode(struct tiff_photograph *t, const struct photograph_request *q, struct image *im,
                     struct photograph_info *info, struct error *err)
{
    float *light = NULL;
    status s = read_header(t, q, err);
    if (s == STATUS_OK) s = declare(t, q, info, err);
    if (s == STATUS_OK && info->encoded && (light = integer_samples_curve(q, info)) == NULL)
        s = error_set(err, STATUS_NO_MEMORY, "cannot read photograph '%s': out of memory", t->name);
    if (s == STATUS_OK) s = image_init(im, t->width, t->height, 3, err);
    if (s == STATUS_OK) s = read_rows(t, light, im, err);
    if (s == STATUS_OK && !info->encoded && info->black_level != 0.0)
        for (size_t i = 0; i < im->width * im->height * 3; i++) im->pixel[i] -= (float)info->black_level;
    if (s == STATUS_OK) take_metadata(t, info);
    if (s != STATUS_OK) image_release(im);
    free(light);
    return s;
}

static status read_tiff(const char *path, const struct photograph_request *q, struct image *im,
                        struct photograph_info *info, struct error *err)
{
    struct tiff_photograph t = {.path = path, .name = path_file_name(path), .n_channel = 1};
    status s = open_tiff(&t, err);
    if (s != STATUS_OK) return s;
    s = decode(&t, q, im, info, err);
    TIFFClose(t.tiff);
    return s;
}

const photograph_reader tiff_photograph_reader = {"tiff_photograph.v1", "TIFF", " tif tiff ", recognise, read_tiff};
