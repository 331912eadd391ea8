/* The table of volume readers. A new format is one file and one row of VOLUME_READERS. */
#ifndef SELVEDGE_GEOMETRY_VOLUME_READER_H
#define SELVEDGE_GEOMETRY_VOLUME_READER_H

#include "geometry/volume/volume_source.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

typedef struct volume_reader {
    const char *id; /* "tiff.v1" */
    /* Does this reader take the files? Decided by the first 16 bytes of the first file (zero-padded) and its name. */
    bool (*recognise)(const uint8_t first_byte[16], const char *path);
    /* On success *handle is closed by close; info is complete but for reader_id. Errors as volume_source_open says. */
    status (*open)(const char *const *path, size_t n_path, void **handle, struct volume_source_info *info,
                   struct error *err);
    /* Slices i_slice .. i_slice + n_slice - 1, which exist, into value[n_slice][rows][columns]. */
    status (*read)(void *handle, size_t i_slice, size_t n_slice, float *value, struct error *err);
    void (*close)(void *handle);
} volume_reader;

/* All formats that a file's beginning or name tells, in the order in which they are asked. */
#define VOLUME_READERS(READER) READER(tiff_reader) READER(metaimage_reader) READER(nrrd_reader) READER(vol_reader)

#define VOLUME_READER_DECLARATION(name) extern const volume_reader name;
VOLUME_READERS(VOLUME_READER_DECLARATION)

size_t volume_reader_count(void);
const volume_reader *volume_reader_at(size_t i);

#endif
