/* Scans on disk behind one interface: they are read slab by slab, whatever the file format.
 *
 * A source returns raw scanner values as floats, in the order of the file's slices (z). The readers are a table of
 * const structs (volume_reader.h); no other code names a format. A source may be used by one thread at a time; the
 * caller opens and closes it. */
#ifndef SELVEDGE_GEOMETRY_VOLUME_SOURCE_H
#define SELVEDGE_GEOMETRY_VOLUME_SOURCE_H

#include "base/status.h"
#include "geometry/volume/format/volume_info.h"

#include <stdbool.h>
#include <stddef.h>

struct volume_source;

/* Opens a scan. path: one multi-page TIFF, one .mhd or .mha, one .nrrd or .nhdr (data file beside it), one .vol, one
 * .npy, one .nii, .nii.gz or .hdr (with its .img), one HDF5, TIFF slices in order, or DICOM
 * slices in any order. The field of errors is OPTION_SCAN_FILES. STATUS_IO, STATUS_NOT_FOUND; STATUS_FORMAT for files
 * that do not have their stated format; STATUS_INVALID for slices without an order; STATUS_UNSUPPORTED. */
status volume_source_open(const char *const *path, size_t n_path, struct volume_source **source, struct error *err);
/* The same; with a declaration (n[0] > 0) the only file at path has raw samples. part: the channel and the time of a
 * file that has several, which is an error where none is chosen. raw and part may be NULL. Fields also OPTION_RAW,
 * OPTION_SCAN_CHANNEL, OPTION_SCAN_TIME, OPTION_SCAN_DATASET. */
status volume_source_open_declared(const char *const *path, size_t n_path, const struct volume_raw_declaration *raw,
                                   const struct volume_part *part, struct volume_source **source, struct error *err);
void volume_source_close(struct volume_source *source);
const struct volume_source_info *volume_source_describe(const struct volume_source *source);
/* Reads slices i_slice .. i_slice + n_slice - 1 to value[n_slice][rows][columns]. */
status volume_source_read(struct volume_source *source, size_t i_slice, size_t n_slice, float *value,
                          struct error *err);

#endif
