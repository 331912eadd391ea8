#include "tests/support/camera_files.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <tiffio.h>

#include <jpeglib.h>

/* Ends the program where a test file cannot be written. */
static void must(bool ok)
{
    if (ok) return;
    fprintf(stderr, "camera_files: cannot write a test file\n");
    abort();
}

static void write_rows(TIFF *tiff, const struct camera_tiff *t, const void *sample)
{
    size_t bytes = t->bits / 8, row_bytes = t->width * bytes * (t->planes ? 1 : t->n_channel);
    uint8_t *row = malloc(row_bytes);
    must(row != NULL);
    for (size_t c = 0; c < (t->planes ? t->n_channel : 1); c++)
        for (size_t y = 0; y < t->height; y++) {
            const uint8_t *from = (const uint8_t *)sample + y * t->width * t->n_channel * bytes;
            for (size_t i = 0; i < row_bytes / bytes; i++)
                memcpy(row + i * bytes, from + (t->planes ? i * t->n_channel + c : i) * bytes, bytes);
            must(TIFFWriteScanline(tiff, row, (uint32_t)y, (uint16_t)c) == 1);
        }
    free(row);
}

/* Tiles of 16 x 16 pixels, which reach beyond the picture. */
static void write_tiles(TIFF *tiff, const struct camera_tiff *t, const void *sample)
{
    enum { TILE = 16 };
    const size_t bytes = t->bits / 8, n_in = t->planes ? 1 : t->n_channel;
    uint8_t *tile = malloc(TILE * TILE * n_in * bytes);
    must(tile != NULL);
    TIFFSetField(tiff, TIFFTAG_TILEWIDTH, (uint32_t)TILE);
    TIFFSetField(tiff, TIFFTAG_TILELENGTH, (uint32_t)TILE);
    for (size_t c = 0; c < (t->planes ? t->n_channel : 1); c++)
        for (size_t y = 0; y < t->height; y += TILE)
            for (size_t x = 0; x < t->width; x += TILE) {
                memset(tile, 0x77, TILE * TILE * n_in * bytes);
                for (size_t i = 0; i < TILE * TILE * n_in; i++) {
                    const size_t at_x = x + i / n_in % TILE, at_y = y + i / n_in / TILE, k = t->planes ? c : i % n_in;
                    if (at_x < t->width && at_y < t->height)
                        memcpy(tile + i * bytes,
                               (const uint8_t *)sample + ((at_y * t->width + at_x) * t->n_channel + k) * bytes, bytes);
                }
                must(TIFFWriteTile(tiff, tile, (uint32_t)x, (uint32_t)y, 0, (uint16_t)c) > 0);
            }
    free(tile);
}

/* Writes the Exif data into a folder of their own; the picture's folder must have been written. */
static void write_exif(TIFF *tiff, double exposure_s, double iso, double aperture)
{
    uint16_t number = (uint16_t)iso;
    uint64_t at = 0;
    must(TIFFCreateEXIFDirectory(tiff) == 0);
    TIFFSetField(tiff, EXIFTAG_EXPOSURETIME, exposure_s);
    TIFFSetField(tiff, EXIFTAG_FNUMBER, aperture);
    TIFFSetField(tiff, EXIFTAG_ISOSPEEDRATINGS, 1, &number);
    must(TIFFWriteCustomDirectory(tiff, &at) == 1);
    must(TIFFSetDirectory(tiff, 0) == 1);
    TIFFSetField(tiff, TIFFTAG_EXIFIFD, at);
    must(TIFFRewriteDirectory(tiff) == 1);
}

static void set_palette(TIFF *tiff)
{
    static uint16_t map[3][256];
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_PALETTE);
    TIFFSetField(tiff, TIFFTAG_COLORMAP, map[0], map[1], map[2]);
}

void camera_write_tiff(const char *path, const struct camera_tiff *t, const void *sample)
{
    TIFF *tiff = TIFFOpen(path, "w");
    uint16_t extra = EXTRASAMPLE_UNASSALPHA;
    must(tiff != NULL);
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, (uint32_t)t->width);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, (uint32_t)t->height);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, t->bits);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, (int)t->n_channel);
    TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, t->bits == 32 ? SAMPLEFORMAT_IEEEFP : SAMPLEFORMAT_UINT);
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, t->planes ? PLANARCONFIG_SEPARATE : PLANARCONFIG_CONTIG);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, t->n_channel < 3 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB);
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, t->deflate ? COMPRESSION_ADOBE_DEFLATE : COMPRESSION_NONE);
    if (t->n_channel % 2 == 0) TIFFSetField(tiff, TIFFTAG_EXTRASAMPLES, 1, &extra);
    if (t->palette) set_palette(tiff);
    if (t->tiled)
        write_tiles(tiff, t, sample);
    else
        write_rows(tiff, t, sample);
    if (t->exposure_s > 0.0) {
        must(TIFFWriteDirectory(tiff) == 1);
        write_exif(tiff, t->exposure_s, t->iso, t->aperture);
    }
    TIFFClose(tiff);
}

/* Exif data of three entries, big-endian. */
static size_t exif_of(double exposure_s, uint8_t out[96])
{
    static const uint8_t start[] = "Exif\0\0MM\0*\0\0\0\x08\0\1\x87\x69\0\4\0\0\0\1\0\0\0\x1a\0\0\0\0"
                                   "\0\3\x82\x9a\0\5\0\0\0\1\0\0\0\x44\x82\x9d\0\5\0\0\0\1\0\0\0\x4c"
                                   "\x88\x27\0\3\0\0\0\1\0\xc8\0\0\0\0\0\0";
    uint32_t value[4] = {(uint32_t)(exposure_s * 1e6), 1000000, 8, 1};
    size_t n = sizeof start - 1;
    memcpy(out, start, n);
    for (size_t i = 0; i < 16; i++) out[n++] = (uint8_t)(value[i / 4] >> (24 - 8 * (i % 4)));
    return n;
}

void camera_write_jpeg(const char *path, size_t width, size_t height, const uint8_t *rgb, double exposure_s)
{
    struct jpeg_compress_struct jpeg;
    struct jpeg_error_mgr manager;
    uint8_t exif[96];
    FILE *file = fopen(path, "wb");
    must(file != NULL);
    jpeg.err = jpeg_std_error(&manager);
    jpeg_create_compress(&jpeg);
    jpeg_stdio_dest(&jpeg, file);
    jpeg.image_width = (JDIMENSION)width;
    jpeg.image_height = (JDIMENSION)height;
    jpeg.input_components = 3;
    jpeg.in_color_space = JCS_RGB;
    jpeg_set_defaults(&jpeg);
    jpeg_set_quality(&jpeg, 100, TRUE);
    for (int c = 0; c < 3; c++) jpeg.comp_info[c].h_samp_factor = jpeg.comp_info[c].v_samp_factor = 1;
    jpeg_start_compress(&jpeg, TRUE);
    if (exposure_s > 0.0) jpeg_write_marker(&jpeg, JPEG_APP0 + 1, exif, (unsigned)exif_of(exposure_s, exif));
    while (jpeg.next_scanline < jpeg.image_height) {
        JSAMPROW row = (JSAMPROW)(uintptr_t)(rgb + (size_t)jpeg.next_scanline * width * 3);
        jpeg_write_scanlines(&jpeg, &row, 1);
    }
    jpeg_finish_compress(&jpeg);
    jpeg_destroy_compress(&jpeg);
    must(fclose(file) == 0);
}
