/* The table of volume readers. Each has a row VOLUME_FORMAT(reader, shown, members of struct volume_format
 * (base/catalogue/volume_format.h)) in its own file, beside the reader; `shown` names the format in lists. The Makefile
 * gathers the rows, from which readers, checks of jobs and clients come. */
#ifndef SELVEDGE_GEOMETRY_VOLUME_READER_H
#define SELVEDGE_GEOMETRY_VOLUME_READER_H

#include "base/status.h"
#include "geometry/volume/format/volume_info.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

typedef struct volume_reader {
    const char *id, *title; /* "tiff.v1"; "TIFF", as messages to users name the format */
    /* Returns whether this reader can read the files, from the first 16 bytes of the first file (padded with zeros)
     * and its name. */
    bool (*recognise)(const uint8_t first_byte[16], const char *path);
    /* part: which channel and time are read, NULL: none is chosen. On success the caller closes *handle with close, and
     * info is complete. Errors as in volume_source_open. */
    status (*open)(const char *const *path, size_t n_path, const struct volume_part *part, void **handle,
                   struct volume_source_info *info, struct error *err);
    /* Reads slices i_slice .. i_slice + n_slice - 1, which exist, to value[n_slice][rows][columns]. */
    status (*read)(void *handle, size_t i_slice, size_t n_slice, float *value, struct error *err);
    void (*close)(void *handle);
    bool has_datasets; /* the part may name one */
} volume_reader;

/* All formats that can be recognised by the start or the name of a file, in the order in which they are tried. */
#define VOLUME_FORMAT(reader, ...) extern const volume_reader reader;
#include "generated/volume_formats.def"
#undef VOLUME_FORMAT
#define VOLUME_FORMAT(reader, ...) /* a row stands for nothing in the file of its reader */

size_t volume_reader_count(void);
const volume_reader *volume_reader_at(size_t i);

#endif
