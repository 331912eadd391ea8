#include "tests/support/scan/scan_files.h"

#include "base/rng.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <tiffio.h>
#include <unistd.h>

static double distance_to(const struct test_cylinder *c, const double x[3])
{
    double norm = 0.0, along = 0.0, square = 0.0;
    for (int a = 0; a < 3; a++) norm += c->direction[a] * c->direction[a];
    for (int a = 0; a < 3; a++) {
        along += (x[a] - c->point[a]) * c->direction[a] / sqrt(norm);
        square += (x[a] - c->point[a]) * (x[a] - c->point[a]);
    }
    return sqrt(fmax(0.0, square - along * along));
}

void test_fill_cylinders(struct volume *v, const struct test_cylinder *c, size_t n_cylinder, double noise_sd,
                         uint64_t seed)
{
    const struct rng_key key = {.seed = seed};
    for (size_t k = 0; k < v->n[2]; k++)
        for (size_t j = 0; j < v->n[1]; j++) {
            struct rng r;
            rng_start(&r, &key, (uint32_t)k, (uint32_t)j);
            for (size_t i = 0; i < v->n[0]; i++) {
                const double x[3] = {(double)i + 0.5, (double)j + 0.5, (double)k + 0.5};
                double density = 0.0, noise[2];
                for (size_t m = 0; m < n_cylinder; m++)
                    density = fmax(density, fmin(1.0, fmax(0.0, c[m].radius - distance_to(&c[m], x) + 0.5)));
                rng_normal_pair(&r, noise);
                v->density[volume_index(v->n, i, j, k)] = (float)(density + noise_sd * noise[0]);
            }
        }
}

static void write_tiles(TIFF *t, const struct test_page *p)
{
    enum { EDGE = 16 };
    size_t bytes = p->bits / 8;
    uint8_t tile[EDGE * EDGE * 4];
    TIFFSetField(t, TIFFTAG_TILEWIDTH, EDGE);
    TIFFSetField(t, TIFFTAG_TILELENGTH, EDGE);
    for (uint32_t y = 0; y < p->height; y += EDGE)
        for (uint32_t x = 0; x < p->width; x += EDGE) {
            memset(tile, 0, sizeof tile);
            for (uint32_t r = 0; r < EDGE && y + r < p->height; r++) {
                size_t n = x + EDGE <= p->width ? EDGE : p->width - x;
                memcpy(tile + r * EDGE * bytes, (const uint8_t *)p->pixel + ((y + r) * p->width + x) * bytes,
                       n * bytes);
            }
            TIFFWriteEncodedTile(t, TIFFComputeTile(t, x, y, 0, 0), tile, (tmsize_t)(EDGE * EDGE * bytes));
        }
}

static void write_strips(TIFF *t, const struct test_page *p)
{
    enum { ROWS = 5 };
    size_t row_bytes = p->width * (size_t)(p->bits / 8);
    uint8_t *copy = malloc(row_bytes * ROWS);
    TIFFSetField(t, TIFFTAG_ROWSPERSTRIP, ROWS);
    for (uint32_t y = 0; y < p->height; y += ROWS) {
        size_t n = y + ROWS <= p->height ? ROWS : p->height - y;
        memcpy(copy, (const uint8_t *)p->pixel + y * row_bytes, n * row_bytes);
        TIFFWriteEncodedStrip(t, y / ROWS, copy, (tmsize_t)(n * row_bytes));
    }
    free(copy);
}

void test_write_tiff(const char *path, const struct test_page *page, size_t n_page, uint16_t compression,
                     enum test_tiff_layout layout)
{
    TIFF *t = TIFFOpen(path, "w");
    for (size_t i = 0; i < n_page; i++) {
        TIFFSetField(t, TIFFTAG_IMAGEWIDTH, page[i].width);
        TIFFSetField(t, TIFFTAG_IMAGELENGTH, page[i].height);
        TIFFSetField(t, TIFFTAG_BITSPERSAMPLE, page[i].bits);
        TIFFSetField(t, TIFFTAG_SAMPLESPERPIXEL, 1);
        TIFFSetField(t, TIFFTAG_SAMPLEFORMAT, page[i].bits == 32 ? SAMPLEFORMAT_IEEEFP : SAMPLEFORMAT_UINT);
        TIFFSetField(t, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
        TIFFSetField(t, TIFFTAG_COMPRESSION, compression);
        if (layout == TEST_TILES)
            write_tiles(t, &page[i]);
        else
            write_strips(t, &page[i]);
        TIFFWriteDirectory(t);
    }
    TIFFClose(t);
}

void test_write_bytes(const char *path, const void *data, size_t n_byte)
{
    FILE *f = fopen(path, "wb");
    if (f == NULL || fwrite(data, 1, n_byte, f) != n_byte) abort();
    fclose(f);
}

void test_make_folder(char path[64])
{
    snprintf(path, 64, "/tmp/selvedge-test-XXXXXX");
    if (mkdtemp(path) == NULL) abort();
}
