/* TIFF through libtiff: float samples are linear; 8- and 16-bit samples need a declared curve. Grey or rgb, in strips
 * or tiles, interleaved or in planes; the first page counts, and more pages are an error. */
#include "base/files/durable.h"
#include "geometry/volume/format/tiff_page.h"
#include "optimizer/photographs/reader/integer_samples.h"
#include "optimizer/photographs/reader/photograph_reader.h"
#include "optimizer/photographs/reader/tiff_statements.h"

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
    bool grey = (t->photometric == PHOTOMETRIC_MINISBLACK ||
                 (t->photometric == PHOTOMETRIC_MINISWHITE && format == SAMPLEFORMAT_UINT)) &&
                t->n_channel <= 2;
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

/* Sample i of a row in the channel c: light, or opacity for alpha. */
static float sample(const struct tiff_photograph *t, const float *light, const uint8_t *row, size_t i, size_t c)
{
    float value;
    uint16_t number = row[i];
    if (t->page.sample == SAMPLE_FLOAT32) {
        memcpy(&value, row + 4 * i, sizeof value);
        return value;
    }
    if (t->page.sample == SAMPLE_UINT16) memcpy(&number, row + 2 * i, sizeof number);
    const unsigned largest = (1u << t->page.bits) - 1;
    const bool alpha = c >= (t->n_channel <= 2 ? 1 : 3);
    if (alpha) return (float)number / (float)largest;
    return light[(c << t->page.bits) + (t->photometric == PHOTOMETRIC_MINISWHITE ? largest - number : number)];
}

/* A part of a row of the picture: n_x pixels from (x, y) on, as stored in a strip or tile. */
struct row_piece {
    const uint8_t *data;
    size_t x, y, n_x;
    size_t i_plane; /* the channel, where channels are stored one after the other */
};

static status take_row(const struct tiff_photograph *t, const float *light, const struct row_piece *p, struct image *im,
                       struct error *err)
{
    bool planes = t->planar == PLANARCONFIG_SEPARATE;
    size_t n_color = t->n_channel <= 2 ? 1 : 3, stride = planes ? 1 : t->n_channel;
    size_t first = planes ? p->i_plane : 0, end = planes ? p->i_plane + 1 : t->n_channel;
    for (size_t c = first; c < end; c++)
        for (size_t x = 0; x < p->n_x; x++) {
            float v = sample(t, light, p->data, x * stride + (planes ? 0 : c), c);
            float *pixel = im->pixel + (p->y * t->width + p->x + x) * 3;
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

static status damaged(const struct tiff_photograph *t, struct error *err)
{
    return error_set(err, STATUS_FORMAT, "cannot read photograph '%s': %s", t->name,
                     t->message[0] != '\0' ? t->message : "damaged data");
}

static status read_rows(struct tiff_photograph *t, const float *light, size_t i_plane, uint8_t *row, struct image *im,
                        struct error *err)
{
    status s = STATUS_OK;
    for (uint32_t y = 0; y < t->height && s == STATUS_OK; y++) {
        const struct row_piece piece = {row, 0, y, t->width, i_plane};
        s = TIFFReadScanline(t->tiff, row, y, (uint16_t)i_plane) == 1 ? take_row(t, light, &piece, im, err)
                                                                      : damaged(t, err);
    }
    return s;
}

static status read_tiles(struct tiff_photograph *t, const float *light, size_t i_plane, uint8_t *tile, struct image *im,
                         struct error *err)
{
    uint32_t width = 0, height = 0;
    status s = STATUS_OK;
    TIFFGetField(t->tiff, TIFFTAG_TILEWIDTH, &width);
    TIFFGetField(t->tiff, TIFFTAG_TILELENGTH, &height);
    const size_t row_bytes = (size_t)TIFFTileRowSize(t->tiff);
    for (uint32_t y = 0; y < t->height && s == STATUS_OK; y += height)
        for (uint32_t x = 0; x < t->width && s == STATUS_OK; x += width) {
            if (TIFFReadTile(t->tiff, tile, x, y, 0, (uint16_t)i_plane) < 0) return damaged(t, err);
            for (uint32_t i = 0; i < height && y + i < t->height && s == STATUS_OK; i++) {
                const size_t n_x = width < t->width - x ? width : t->width - x;
                const struct row_piece piece = {tile + i * row_bytes, x, y + i, n_x, i_plane};
                s = take_row(t, light, &piece, im, err);
            }
        }
    return s;
}

/* Returns the bytes of a strip's row or of a tile, 0 for sizes that no photograph has. */
static size_t piece_bytes(const struct tiff_photograph *t, const struct photograph_request *q)
{
    uint32_t width = 0, height = 0;
    if (!TIFFIsTiled(t->tiff)) return TIFFScanlineSize(t->tiff) > 0 ? (size_t)TIFFScanlineSize(t->tiff) : 0;
    TIFFGetField(t->tiff, TIFFTAG_TILEWIDTH, &width);
    TIFFGetField(t->tiff, TIFFTAG_TILELENGTH, &height);
    if (width == 0 || height == 0 || width > q->limit_pixel || height > q->limit_pixel / width) return 0;
    return TIFFTileSize(t->tiff) > 0 ? (size_t)TIFFTileSize(t->tiff) : 0;
}

static status read_samples(struct tiff_photograph *t, const struct photograph_request *q, const float *light,
                           struct image *im, struct error *err)
{
    const size_t n_plane = t->planar == PLANARCONFIG_SEPARATE ? t->n_channel : 1, bytes = piece_bytes(t, q);
    if (bytes == 0)
        return error_set(err, STATUS_FORMAT, "cannot read photograph '%s': its tiles have no size that can be",
                         t->name);
    uint8_t *piece = malloc(bytes + (size_t)t->page.width * 4);
    status s = piece != NULL ? STATUS_OK
                             : error_set(err, STATUS_NO_MEMORY, "cannot read photograph '%s': out of memory", t->name);
    for (size_t c = 0; c < n_plane && s == STATUS_OK; c++)
        s = TIFFIsTiled(t->tiff) ? read_tiles(t, light, c, piece, im, err) : read_rows(t, light, c, piece, im, err);
    free(piece);
    return s;
}

static status declare(const struct tiff_photograph *t, const struct photograph_request *q, struct declared_color *color,
                      struct photograph_info *info, struct error *err)
{
    info->has_alpha = t->n_channel == 2 || t->n_channel == 4;
    status s = tiff_statements_read(t->tiff, t->path, color, info, err);
    if (s != STATUS_OK) return s;
    if (t->page.sample != SAMPLE_FLOAT32) return integer_samples_declare(t->path, q, t->page.bits, color, info, err);
    info->bits = 32;
    info->black_level = isnan(q->black_level) ? 0.0 : q->black_level;
    if (color->curve[0] == NULL || declared_color_difference(color, JOB_TRANSFER_LINEAR) < 1e-3) return STATUS_OK;
    return error_set(err, STATUS_UNSUPPORTED,
                     "cannot use photograph '%s': its samples are floats, which are linear, but its %s says that they "
                     "are %s: save it as linear",
                     t->name, color->source, color->curve_name);
}

static status decode(struct tiff_photograph *t, const struct photograph_request *q, struct declared_color *color,
                     struct image *im, struct photograph_info *info, struct error *err)
{
    float *light = NULL;
    status s = read_header(t, q, err);
    if (s == STATUS_OK) s = declare(t, q, color, info, err);
    if (s == STATUS_OK && info->encoded) {
        light = integer_samples_curves(q, color, tiff_largest_sample(t->tiff, t->page.bits, info), info);
        if (light == NULL) s = error_set(err, STATUS_NO_MEMORY, "cannot read photograph '%s': out of memory", t->name);
    }
    if (s == STATUS_OK) s = image_init(im, t->width, t->height, 3, err);
    if (s == STATUS_OK) s = read_samples(t, q, light, im, err);
    if (s == STATUS_OK && !info->encoded && info->black_level != 0.0)
        for (size_t i = 0; i < im->width * im->height * 3; i++) im->pixel[i] -= (float)info->black_level;
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
    struct declared_color color = {0};
    s = decode(&t, q, &color, im, info, err);
    declared_color_release(&color);
    TIFFClose(t.tiff);
    return s;
}

const photograph_reader tiff_photograph_reader = {"tiff_photograph.v1", "TIFF", " tif tiff ", recognise, read_tiff};
