/* PNG through libpng. Its longjmp stays in this file. */
#include "base/files/durable.h"
#include "optimizer/photographs/reader/exif.h"
#include "optimizer/photographs/reader/integer_samples.h"
#include "optimizer/photographs/reader/photograph_reader.h"
#include "optimizer/photographs/reader/png_raw_profile.h"
#include "optimizer/photographs/reader/xmp.h"

#include <math.h>
#include <png.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

struct png_failure {
    char text[160], warning[80];
};

static void on_error(png_structp png, png_const_charp text)
{
    struct png_failure *f = png_get_error_ptr(png);
    snprintf(f->text, sizeof f->text, "%s", text);
    png_longjmp(png, 1);
}

static void on_warning(png_structp png, png_const_charp text)
{
    struct png_failure *f = png_get_error_ptr(png);
    if (f->warning[0] == '\0') snprintf(f->warning, sizeof f->warning, "%s", text);
}

static bool recognise(const uint8_t first[PHOTOGRAPH_FIRST_BYTES])
{
    return memcmp(first, "\x89PNG\r\n\x1a\n", 8) == 0;
}

/* Channel c of pixel x of a row that holds grey or rgb, with or without alpha. Grey may have 1, 2 or 4 bits. */
static unsigned sample(const png_byte *row, unsigned depth, size_t x, size_t c, size_t n_channel)
{
    if (depth < 8) {
        const size_t bit = x * depth;
        return row[bit / 8] >> (8 - depth - bit % 8) & ((1u << depth) - 1);
    }
    const png_byte *p = row + (n_channel * x + c) * (depth / 8);
    return depth == 16 ? (unsigned)p[0] << 8 | p[1] : p[0];
}

/* The color of chunk tRNS whose pixels are transparent. Returns false when the file has none. */
static bool transparent_color(png_structp png, png_infop info, unsigned color[3])
{
    png_bytep alpha = NULL;
    png_color_16p key = NULL;
    int n = 0;
    if (png_get_tRNS(png, info, &alpha, &n, &key) == 0 || key == NULL) return false;
    const bool grey = (png_get_color_type(png, info) & PNG_COLOR_MASK_COLOR) == 0;
    color[0] = grey ? key->gray : key->red;
    color[1] = grey ? key->gray : key->green;
    color[2] = grey ? key->gray : key->blue;
    return true;
}

static status convert(png_structp png, png_infop info, const float *light, struct image *im, const char *path,
                      struct error *err)
{
    png_bytepp row = png_get_rows(png, info);
    unsigned key[3] = {0};
    const bool has_key = transparent_color(png, info, key);
    const unsigned depth = png_get_bit_depth(png, info), largest = (1u << depth) - 1;
    size_t n = png_get_channels(png, info), n_color = n <= 2 ? 1 : 3;
    for (size_t y = 0; y < im->height; y++) {
        for (size_t x = 0; x < im->width; x++) {
            bool is_key = has_key;
            for (size_t c = 0; c < 3; c++) {
                const unsigned value = sample(row[y], depth, x, n_color == 3 ? c : 0, n);
                im->pixel[(y * im->width + x) * 3 + c] = light[(c << depth) + value];
                is_key = is_key && value == key[c];
            }
            if (is_key || (n > n_color && sample(row[y], depth, x, n_color, n) != largest))
                return integer_samples_transparent(path, err);
        }
    }
    return STATUS_OK;
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

static void take_exif(png_structp png, png_infop png_info, struct photograph_info *info)
{
    png_uint_32 n = 0;
    png_bytep exif = NULL;
    if (png_get_eXIf_1(png, png_info, &n, &exif) != 0 && exif != NULL) exif_read_bytes(exif, n, info);
    png_textp text = NULL;
    const int n_text = png_get_text(png, png_info, &text, NULL);
    for (int i = 0; i < n_text; i++) {
        if (text[i].text == NULL) continue;
        if (strcmp(text[i].key, "XML:com.adobe.xmp") == 0) xmp_read(text[i].text, strlen(text[i].text), info);
        png_raw_profile_read(text[i].key, text[i].text, strlen(text[i].text), info);
    }
}

/* gAMA and cHRM, which sRGB and iCCP replace. */
static status take_gamma(png_structp png, png_infop png_info, struct declared_color *color,
                         struct photograph_info *info, struct error *err)
{
    double gamma = 0.0;
    struct color_primaries p;
    const char *reason = color->curve[0] != NULL ? "another statement comes first" : NULL;
    if (png_get_gAMA(png, png_info, &gamma) != 0 && gamma > 0.0) {
        file_ledger_add(&info->ledger, "gAMA", reason, "%.5g", gamma);
        color->rounded = reason == NULL && fabs(gamma - 0.45455) < 1e-3;
        status s = declared_color_power(color, "gAMA chunk", 1.0 / gamma, err);
        if (s != STATUS_OK) return s;
    }
    if (png_get_cHRM(png, png_info, &p.xy[3][0], &p.xy[3][1], &p.xy[0][0], &p.xy[0][1], &p.xy[1][0], &p.xy[1][1],
                     &p.xy[2][0], &p.xy[2][1]) == 0)
        return STATUS_OK;
    if (reason == NULL)
        declared_color_primaries(info, "cHRM", &p);
    else
        file_ledger_add(&info->ledger, "cHRM", reason, "white %.4g %.4g", p.xy[3][0], p.xy[3][1]);
    return STATUS_OK;
}

/* Chunks about colors in the order of PNG 3: cICP, iCCP, sRGB, gAMA and cHRM; at last Exif. */
static status take_colors(png_structp png, png_infop png_info, const char *path, struct declared_color *color,
                          struct photograph_info *info, struct error *err)
{
    const bool grey = (png_get_color_type(png, png_info) & PNG_COLOR_MASK_COLOR) == 0;
    png_unknown_chunkp chunk = NULL;
    png_charp profile_name;
    png_bytep profile;
    png_uint_32 n_profile;
    int how, n_chunk = png_get_unknown_chunks(png, png_info, &chunk);
    status s = STATUS_OK;
    for (int i = 0; i < n_chunk && s == STATUS_OK; i++)
        if (memcmp(chunk[i].name, "cICP", 4) == 0 && chunk[i].size == 4)
            s = declared_color_cicp(color, path, chunk[i].data, info, err);
    if (s == STATUS_OK && png_get_iCCP(png, png_info, &profile_name, &how, &profile, &n_profile) != 0)
        s = declared_color_icc(color, path, profile, n_profile, grey, info, err);
    if (s == STATUS_OK && png_get_sRGB(png, png_info, &how) != 0) {
        file_ledger_add(&info->ledger, "sRGB chunk", color->curve[0] != NULL ? "another statement comes first" : NULL,
                        "rendering intent %d", how);
        s = declared_color_srgb(color, "sRGB chunk", err);
    }
    if (s == STATUS_OK) s = take_gamma(png, png_info, color, info, err);
    return s == STATUS_OK ? declared_color_exif(color, info, err) : s;
}

/* Enters the other chunks that say something of the picture. Returns the largest sample value. */
static unsigned take_others(png_structp png, png_infop png_info, const struct png_failure *failure,
                            struct photograph_info *info)
{
    png_color_8p significant = NULL;
    png_uint_32 x = 0, y = 0;
    int unit = 0;
    unsigned bits[3] = {0};
    if (png_get_sBIT(png, png_info, &significant) != 0 && significant != NULL) {
        const bool grey = (png_get_color_type(png, png_info) & PNG_COLOR_MASK_COLOR) == 0;
        bits[0] = grey ? significant->gray : significant->red;
        bits[1] = grey ? significant->gray : significant->green;
        bits[2] = grey ? significant->gray : significant->blue;
    }
    if (png_get_pHYs(png, png_info, &x, &y, &unit) != 0)
        file_ledger_add(&info->ledger, "pHYs", "lengths follow from the crop", "%u x %u pixels per %s", x, y,
                        unit == PNG_RESOLUTION_METER ? "m" : "unit");
    if (info->has_alpha) file_ledger_add(&info->ledger, "alpha", "it is opaque everywhere", "one channel");
    unsigned key[3];
    if (transparent_color(png, png_info, key))
        file_ledger_add(&info->ledger, "transparency", "no pixel has this color", "color %u %u %u", key[0], key[1],
                        key[2]);
    if (failure->warning[0] != '\0')
        file_ledger_add(&info->ledger, "damage beside the samples", "it is left out", "%s", failure->warning);
    return integer_samples_significant(bits, png_get_bit_depth(png, png_info), info);
}

/* Converts the rows that libpng has read. */
static status take_rows(png_structp png, png_infop png_info, const char *path, const struct photograph_request *q,
                        struct declared_color *color, struct image *im, struct photograph_info *info, struct error *err)
{
    if (png_get_color_type(png, png_info) == PNG_COLOR_TYPE_PALETTE) return integer_samples_palette(path, err);
    take_exif(png, png_info, info);
    info->has_alpha = (png_get_color_type(png, png_info) & PNG_COLOR_MASK_ALPHA) != 0;
    status s = take_colors(png, png_info, path, color, info, err);
    if (s == STATUS_OK) s = integer_samples_declare(path, q, png_get_bit_depth(png, png_info), color, info, err);
    if (s != STATUS_OK) return s;
    float *light = integer_samples_curves(q, color, take_others(png, png_info, png_get_error_ptr(png), info), info);
    if (light == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot read photograph '%s': out of memory", path_file_name(path));
    s = image_init(im, png_get_image_width(png, png_info), png_get_image_height(png, png_info), 3, err);
    if (s == STATUS_OK) s = convert(png, png_info, light, im, path, err);
    if (s != STATUS_OK) image_release(im);
    free(light);
    return s;
}

static status read_png(const char *path, const struct photograph_request *q, struct image *im,
                       struct photograph_info *info, struct error *err)
{
    const char *name = path_file_name(path);
    struct png_failure failure = {{0}, {0}};
    struct declared_color color = {0};
    FILE *f = fopen(path, "rbe");
    if (f == NULL) return error_set_errno(err, "cannot read photograph '%s'", name);
    status s = check_size(f, name, q->limit_pixel, err);
    if (s != STATUS_OK) {
        fclose(f);
        return s;
    }
    png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &failure, on_error, on_warning);
    png_infop png_info = png != NULL ? png_create_info_struct(png) : NULL;
    if (png_info == NULL) {
        s = error_set(err, STATUS_NO_MEMORY, "cannot read photograph '%s': out of memory", name);
    } else if (setjmp(png_jmpbuf(png))) {
        s = error_set(err, STATUS_FORMAT, "cannot read photograph '%s': %s", name, failure.text);
    } else {
        png_init_io(png, f);
        png_set_keep_unknown_chunks(png, PNG_HANDLE_CHUNK_ALWAYS, (png_const_bytep) "cICP", 1);
        png_read_png(png, png_info, PNG_TRANSFORM_IDENTITY, NULL);
        s = take_rows(png, png_info, path, q, &color, im, info, err);
    }
    declared_color_release(&color);
    if (png != NULL) png_destroy_read_struct(&png, png_info != NULL ? &png_info : NULL, NULL);
    fclose(f);
    return s;
}

const photograph_reader png_photograph_reader = {"png.v1", "PNG", " png ", recognise, read_png};
