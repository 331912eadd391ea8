/* Scans on disk behind one interface: read slab by slab, whatever the file format.
 *
 * A source gives raw scanner values as floats, slices (file's z) in order. The registry of readers is a table of const
 * structs (volume_reader.h); nothing else names a format.
 * Threads: one thread per source. Ownership: open/close.
 */
#ifndef SELVEDGE_GEOMETRY_VOLUME_SOURCE_H
#define SELVEDGE_GEOMETRY_VOLUME_SOURCE_H

#include "base/status.h"

#include <stddef.h>

struct volume_source;

struct volume_source_info {
    size_t n[3];            /* columns, rows, slices */
    double voxel_size_m[3]; /* NaN where the file does not say */
    const char *reader_id;  /* "tiff.v1" */
    const char *sample;     /* "uint8", "uint16", "int16", "float32" */
};

/* path: one multi-page TIFF, one .mhd or .mha, one .vol, or TIFF slices in order. The field of errors is "volume.files".
 * STATUS_IO, STATUS_NOT_FOUND; STATUS_FORMAT for files that are not what they claim to be; STATUS_UNSUPPORTED. */
status volume_source_open(const char *const *path, size_t n_path, struct volume_source **source, struct error *err);
void volume_source_close(struct volume_source *source);
const struct volume_source_info *volume_source_describe(const struct volume_source *source);
/* Slices i_slice .. i_slice + n_slice - 1 into value[n_slice][rows][columns]. */
status volume_source_read(struct volume_source *source, size_t i_slice, size_t n_slice, float *value,
                          struct error *err);

#endif
