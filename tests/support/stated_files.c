#include "tests/support/stated_files.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include <jpeglib.h>

static void must(bool ok)
{
    if (ok) return;
    fprintf(stderr, "stated_files: cannot write a test file\n");
    abort();
}

/* ---- folders ---- */

struct folder_writer {
    uint8_t *out;
    size_t n, room;
    bool big_endian;
};

static void put_at(struct folder_writer *w, size_t at, uint64_t value, size_t n_byte)
{
    must(at + n_byte <= w->room);
    for (size_t i = 0; i < n_byte; i++) w->out[at + i] = (uint8_t)(value >> 8 * (w->big_endian ? n_byte - 1 - i : i));
}

static void put(struct folder_writer *w, uint64_t value, size_t n_byte)
{
    put_at(w, w->n, value, n_byte);
    w->n += n_byte;
}

static size_t bytes_of(const struct folder_entry *e)
{
    static const size_t bytes[] = {0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8};
    return bytes[e->type] * (e->n > 0 ? e->n : 1);
}

static void put_value(struct folder_writer *w, const struct folder_entry *e)
{
    float single = (float)e->value;
    uint32_t bits;
    uint64_t twice;
    if (e->bytes != NULL) {
        must(w->n + e->n <= w->room);
        memcpy(w->out + w->n, e->bytes, e->n);
        w->n += e->n;
    } else if (e->n > 0) {
        for (size_t i = 0; i < e->n; i++) put(w, e->list[i], 2);
    } else if (e->type == 5 || e->type == 10) {
        put(w, (uint64_t)(int64_t)lrint(e->value * 10000.0) & 0xffffffff, 4);
        put(w, 10000, 4);
    } else if (e->type == 11) {
        memcpy(&bits, &single, 4);
        put(w, bits, 4);
    } else if (e->type == 12) {
        memcpy(&twice, &e->value, 8);
        put(w, twice, 8);
    } else {
        put(w, (uint64_t)(int64_t)lrint(e->value), bytes_of(e));
    }
}

/* Writes the entries of one folder and then their long values. inner_at: place of the number of the tag 0x8769. */
static void put_folder(struct folder_writer *w, const struct folder_entry *entry, size_t n, bool inner,
                       size_t *inner_at, size_t *samples_at)
{
    size_t count = 0, long_at[64] = {0};
    for (size_t i = 0; i < n; i++) count += entry[i].inner == inner;
    put(w, count + (inner_at != NULL), 2);
    for (size_t i = 0; i < n; i++) {
        if (entry[i].inner != inner) continue;
        put(w, entry[i].tag, 2);
        put(w, entry[i].type, 2);
        put(w, entry[i].n > 0 ? entry[i].n : 1, 4);
        size_t start = w->n;
        if (entry[i].tag == 273) *samples_at = start;
        if (bytes_of(&entry[i]) <= 4)
            put_value(w, &entry[i]);
        else
            long_at[i] = start;
        while (w->n < start + 4) put(w, 0, 1);
    }
    if (inner_at != NULL) {
        put(w, 0x8769, 2);
        put(w, 4, 2);
        put(w, 1, 4);
        *inner_at = w->n;
        put(w, 0, 4);
    }
    put(w, 0, 4);
    for (size_t i = 0; i < n; i++) {
        if (long_at[i] == 0) continue;
        put_at(w, long_at[i], w->n, 4);
        put_value(w, &entry[i]);
        if (w->n % 2 == 1) put(w, 0, 1);
    }
}

size_t folder_build(bool big_endian, const struct folder_entry *entry, size_t n, const void *samples, size_t n_bytes,
                    uint8_t *out, size_t room)
{
    struct folder_writer w = {out, 0, room, big_endian};
    size_t inner_at = 0, samples_at = 0, n_inner = 0;
    for (size_t i = 0; i < n; i++) n_inner += entry[i].inner;
    must(n <= 64);
    memset(out, 0, room);
    put(&w, big_endian ? 0x4d4d : 0x4949, 2);
    put(&w, 42, 2);
    put(&w, 8, 4);
    put_folder(&w, entry, n, false, n_inner > 0 ? &inner_at : NULL, &samples_at);
    if (n_inner > 0) {
        put_at(&w, inner_at, w.n, 4);
        put_folder(&w, entry, n, true, NULL, &samples_at);
    }
    if (samples_at > 0) {
        put_at(&w, samples_at, w.n, 4);
        must(w.n + n_bytes <= room);
        memcpy(out + w.n, samples, n_bytes);
        w.n += n_bytes;
    }
    return w.n;
}

/* ---- PNG ---- */

static void put_number(FILE *file, uint32_t value)
{
    for (int shift = 24; shift >= 0; shift -= 8) fputc((int)(value >> shift & 255), file);
}

static void put_chunk(FILE *file, const char *type, const void *data, size_t n)
{
    put_number(file, (uint32_t)n);
    fwrite(type, 1, 4, file);
    if (n > 0) fwrite(data, 1, n, file);
    uLong crc = crc32(0, (const Bytef *)type, 4);
    put_number(file, (uint32_t)(n > 0 ? crc32(crc, data, (uInt)n) : crc));
}

void stated_write_png(const char *path, size_t width, size_t height, unsigned depth, unsigned channels,
                      const uint16_t *sample, const struct file_part *part, size_t n_part)
{
    static const uint8_t color[] = {0, 0, 4, 2, 6};
    const size_t per_row = width * channels, row_bytes = (per_row * depth + 7) / 8;
    uint8_t *raw = calloc(height, row_bytes + 1), head[13] = {0};
    uLongf n_packed = compressBound(height * (row_bytes + 1));
    uint8_t *packed = malloc(n_packed);
    FILE *file = fopen(path, "wb");
    must(raw != NULL && packed != NULL && file != NULL);
    for (size_t i = 0; i < height * per_row; i++) {
        uint8_t *to = raw + i / per_row * (row_bytes + 1) + 1;
        const size_t bit = i % per_row * depth;
        if (depth == 16)
            to[bit / 8] = (uint8_t)(sample[i] >> 8), to[bit / 8 + 1] = (uint8_t)sample[i];
        else
            to[bit / 8] = (uint8_t)(to[bit / 8] | sample[i] << (8 - depth - bit % 8));
    }
    must(compress2(packed, &n_packed, raw, height * (row_bytes + 1), 6) == Z_OK);
    for (int i = 0; i < 4; i++) {
        head[i] = (uint8_t)(width >> (24 - 8 * i));
        head[4 + i] = (uint8_t)(height >> (24 - 8 * i));
    }
    head[8] = (uint8_t)depth;
    head[9] = color[channels];
    fwrite("\x89PNG\r\n\x1a\n", 1, 8, file);
    put_chunk(file, "IHDR", head, sizeof head);
    for (size_t i = 0; i < n_part; i++) put_chunk(file, part[i].type, part[i].data, part[i].n);
    put_chunk(file, "IDAT", packed, n_packed);
    put_chunk(file, "IEND", NULL, 0);
    must(fclose(file) == 0);
    free(raw);
    free(packed);
}

void stated_write_png_bytes(const char *path, size_t width, size_t height, const uint8_t *rgb)
{
    uint16_t *sample = malloc(3 * width * height * sizeof *sample);
    must(sample != NULL);
    for (size_t i = 0; i < 3 * width * height; i++) sample[i] = rgb[i];
    stated_write_png(path, width, height, 8, 3, sample, NULL, 0);
    free(sample);
}

/* ---- JPEG ---- */

void stated_write_jpeg(const char *path, size_t width, size_t height, const uint8_t *rgb, const struct file_part *part,
                       size_t n_part)
{
    struct jpeg_compress_struct jpeg;
    struct jpeg_error_mgr manager;
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
    for (size_t i = 0; i < n_part; i++) jpeg_write_marker(&jpeg, part[i].marker, part[i].data, (unsigned)part[i].n);
    while (jpeg.next_scanline < jpeg.image_height) {
        JSAMPROW row = (JSAMPROW)(uintptr_t)(rgb + (size_t)jpeg.next_scanline * width * 3);
        jpeg_write_scanlines(&jpeg, &row, 1);
    }
    jpeg_finish_compress(&jpeg);
    jpeg_destroy_compress(&jpeg);
    must(fclose(file) == 0);
}
