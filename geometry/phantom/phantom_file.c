#include "base/angle.h"
#include "base/files/durable.h"
#include "geometry/phantom/phantom.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <tiffio.h>
#include <unistd.h>

void phantom_file_option_default(struct phantom_file_option *o)
{
    *o = (struct phantom_file_option){.bits = 16, .void_value = 10000.0, .fiber_value = 40000.0, .deflate = true};
}

static status check(const struct phantom_file_option *o, const char *path, struct error *err)
{
    if (o->bits != 8 && o->bits != 16)
        return error_set_field(err, STATUS_INVALID, "bits",
                               "cannot write '%s': %d bits per voxel, but it must be 8 or 16", path, o->bits);
    return STATUS_OK;
}

/* n voxels in the byte order of the machine. libtiff handles it, and it is little-endian, as the .mhd states, on all
 * supported machines. */
static void encode(const float *from, size_t n, const struct phantom_file_option *o, uint8_t *to)
{
    double top = o->bits == 8 ? 255.0 : 65535.0;
    for (size_t i = 0; i < n; i++) {
        double value = round(o->void_value + (double)from[i] * (o->fiber_value - o->void_value));
        uint16_t u = (uint16_t)(value < 0.0 ? 0.0 : value > top ? top : value);
        if (o->bits == 8)
            to[i] = (uint8_t)u;
        else
            memcpy(to + 2 * i, &u, sizeof u);
    }
}

/* Keeps libtiff from printing. Its first message is the cause, and later ones follow from it. */
static int keep_message(TIFF *t, void *context, const char *module, const char *format, va_list args)
{
    struct error *err = context;
    (void)t;
    (void)module;
    if (err->text[0] == '\0') vsnprintf(err->text, sizeof err->text, format, args);
    return 1;
}

static int drop_message(TIFF *t, void *context, const char *module, const char *format, va_list args)
{
    (void)t, (void)context, (void)module, (void)format, (void)args;
    return 1;
}

static bool write_page(TIFF *t, const struct volume *v, size_t k, const struct phantom_file_option *o, uint8_t *row)
{
    uint32_t rows = v->n[1] < 64 ? (uint32_t)v->n[1] : 64;
    bool ok = TIFFSetField(t, TIFFTAG_IMAGEWIDTH, (uint32_t)v->n[0]) &&
              TIFFSetField(t, TIFFTAG_IMAGELENGTH, (uint32_t)v->n[1]) &&
              TIFFSetField(t, TIFFTAG_BITSPERSAMPLE, o->bits) && TIFFSetField(t, TIFFTAG_SAMPLESPERPIXEL, 1) &&
              TIFFSetField(t, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK) &&
              TIFFSetField(t, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG) &&
              TIFFSetField(t, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT) && TIFFSetField(t, TIFFTAG_ROWSPERSTRIP, rows) &&
              TIFFSetField(t, TIFFTAG_COMPRESSION, o->deflate ? COMPRESSION_ADOBE_DEFLATE : COMPRESSION_NONE);
    if (ok && o->deflate)
        ok = TIFFSetField(t, TIFFTAG_PREDICTOR, PREDICTOR_HORIZONTAL) && TIFFSetField(t, TIFFTAG_ZIPQUALITY, 3);
    scratch_keep_within(v->space);
    for (size_t j = 0; j < v->n[1] && ok; j++) {
        encode(v->density + volume_index(v->n, 0, j, k), v->n[0], o, row);
        ok = TIFFWriteScanline(t, row, (uint32_t)j, 0) == 1;
    }
    return ok && TIFFWriteDirectory(t) == 1;
}

status phantom_write_tiff(const struct volume *v, const struct phantom_file_option *o, const char *path,
                          struct error *err)
{
    status st = check(o, path, err);
    if (st != STATUS_OK) return st;
    struct error cause = {0};
    TIFF *t = NULL;
    uint8_t *row = malloc(2 * v->n[0] + 2);
    TIFFOpenOptions *options = TIFFOpenOptionsAlloc();
    if (row == NULL || options == NULL) {
        st = error_set(err, STATUS_NO_MEMORY, "cannot write volume '%s': out of memory", path);
        goto out;
    }
    TIFFOpenOptionsSetErrorHandlerExtR(options, keep_message, &cause);
    TIFFOpenOptionsSetWarningHandlerExtR(options, drop_message, NULL);
    uint64_t n_bytes = (uint64_t)volume_n_voxel(v->n) * (o->bits == 8 ? 1 : 2);
    t = TIFFOpenExt(path, n_bytes > 0xf0000000u ? "w8" : "w", options);
    if (t == NULL) {
        st = error_set_field(err, STATUS_IO, path, "cannot write volume '%s': %s", path, cause.text);
        goto out;
    }
    for (size_t k = 0; k < v->n[2] && st == STATUS_OK; k++) {
        errno = 0;
        if (!write_page(t, v, k, o, row))
            st = error_set(err, errno == ENOSPC ? STATUS_DISK_FULL : STATUS_IO,
                           "cannot write volume '%s': page %zu: %s", path, k + 1, cause.text);
    }
    TIFFClose(t);
    if (st != STATUS_OK) unlink(path);
out:
    if (options != NULL) TIFFOpenOptionsFree(options);
    free(row);
    return st;
}

/* Writes slice by slice to a temporary file. */
static status write_raw(const struct volume *v, const struct phantom_file_option *o, const char *path,
                        struct error *err)
{
    size_t n_slice = v->n[0] * v->n[1], slice_bytes = n_slice * (o->bits == 8 ? 1 : 2);
    char temporary[4096 + 8];
    uint8_t *data = malloc(slice_bytes);
    if (data == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write volume '%s': out of memory", path);
    snprintf(temporary, sizeof temporary, "%s.part", path);
    FILE *file = fopen(temporary, "wbe");
    bool ok = file != NULL;
    for (size_t k = 0; k < v->n[2] && ok; k++) {
        scratch_keep_within(v->space);
        encode(v->density + k * n_slice, n_slice, o, data);
        ok = fwrite(data, slice_bytes, 1, file) == 1;
    }
    ok = ok && fflush(file) == 0 && fsync(fileno(file)) == 0;
    status st = ok ? STATUS_OK : error_set_errno(err, "cannot write volume '%s'", path);
    if (file != NULL && fclose(file) != 0 && st == STATUS_OK)
        st = error_set_errno(err, "cannot write volume '%s'", path);
    if (st == STATUS_OK && rename(temporary, path) != 0) st = error_set_errno(err, "cannot write volume '%s'", path);
    if (st != STATUS_OK && file != NULL) unlink(temporary);
    free(data);
    return st;
}

status phantom_write_metaimage(const struct volume *v, const struct phantom_file_option *o, const char *path,
                               struct error *err)
{
    status st = check(o, path, err);
    if (st != STATUS_OK) return st;
    size_t length = strlen(path);
    char raw[4096], header[1024];
    if (length < 5 || strcmp(path + length - 4, ".mhd") != 0 || length >= sizeof raw)
        return error_set(err, STATUS_INVALID, "cannot write volume '%s': the name must end in .mhd", path);
    snprintf(raw, sizeof raw, "%.*s.raw", (int)(length - 4), path);
    const char *base = strrchr(raw, '/');
    base = base != NULL ? base + 1 : raw;
    st = write_raw(v, o, raw, err);
    if (st != STATUS_OK) return st;
    int n = snprintf(
        header, sizeof header,
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n"
        "DimSize = %zu %zu %zu\nElementSpacing = %.9g %.9g %.9g\nElementType = %s\nElementDataFile = %s\n",
        v->n[0], v->n[1], v->n[2], 1e3 * v->voxel_size_m[0], 1e3 * v->voxel_size_m[1], 1e3 * v->voxel_size_m[2],
        o->bits == 8 ? "MET_UCHAR" : "MET_USHORT", base);
    if (n < 0 || n >= (int)sizeof header)
        return error_set(err, STATUS_INVALID, "cannot write volume '%s': the name is too long", path);
    return durable_replace(path, header, (size_t)n, err);
}

status phantom_write_sections(const struct fiber_set *f, const struct phantom_section_law *law, const char *path,
                              struct error *err)
{
    char *text = NULL;
    size_t length = 0;
    FILE *file = open_memstream(&text, &length);
    if (file == NULL) return error_set_errno(err, "cannot write '%s'", path);
    fputs("fiber,radius_um,lumen,aspect,bean,angle_deg,turn_deg_per_um\n", file);
    for (size_t i = 0; i < f->n_fiber; i++) {
        struct phantom_section c = phantom_section_of(law, i);
        fprintf(file, "%zu,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g\n", i, 1e6 * (double)f->radius_m[i], c.lumen, c.aspect, c.bean,
                angle_to_deg(c.angle_rad), 1e-6 * angle_to_deg(c.turn_rad_per_m));
    }
    bool ok = ferror(file) == 0;
    ok = fclose(file) == 0 && ok;
    status st = ok ? durable_replace(path, text, length, err)
                   : error_set(err, STATUS_NO_MEMORY, "cannot write '%s': out of memory", path);
    free(text);
    return st;
}
