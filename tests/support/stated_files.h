/* Pictures with statements beside their samples, byte by byte: TIFF and Exif folders with entries of any type and byte
 * order, PNG with any chunks, JPEG with any markers. */
#ifndef SELVEDGE_TESTS_STATED_FILES_H
#define SELVEDGE_TESTS_STATED_FILES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* An entry of a folder: one number, or `n` numbers of type 3 (16 bits). value: rounded for integers; a rational gets
 * the denominator 10000. */
struct folder_entry {
    uint16_t tag, type;
    double value;
    bool inner; /* belongs to the Exif folder */
    size_t n;   /* 0: one */
    const uint16_t *list;
    const void *bytes; /* n bytes of type 7, in place of a value */
};

/* Writes a TIFF structure of at most `room` bytes: entries in the order of their tags, first the outer ones. samples:
 * follow the folders, their place becomes the value of the entry 273. Returns its size. */
size_t folder_build(bool big_endian, const struct folder_entry *entry, size_t n, const void *samples, size_t n_bytes,
                    uint8_t *out, size_t room);

/* A chunk of a PNG or a marker of a JPEG. */
struct file_part {
    const char *type; /* of a chunk, four letters */
    int marker;       /* of a JPEG, 0xe1 and others */
    const void *data;
    size_t n;
};

/* channels: 1 to 4 of `depth` bits; sample: values in order, of 16 bits each. Parts lie before the picture data. */
void stated_write_png(const char *path, size_t width, size_t height, unsigned depth, unsigned channels,
                      const uint16_t *sample, const struct file_part *part, size_t n_part);
/* An rgb PNG of 8 bits that states nothing. */
void stated_write_png_bytes(const char *path, size_t width, size_t height, const uint8_t *rgb);
/* An rgb JPEG of quality 100 without subsampling. */
void stated_write_jpeg(const char *path, size_t width, size_t height, const uint8_t *rgb, const struct file_part *part,
                       size_t n_part);

#endif
