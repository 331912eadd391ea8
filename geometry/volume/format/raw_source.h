/* Raw samples without a header, as the user declares them. x runs fastest, then y, then z. */
#ifndef SELVEDGE_GEOMETRY_RAW_SOURCE_H
#define SELVEDGE_GEOMETRY_RAW_SOURCE_H

#include "geometry/volume/format/volume_reader.h"

/* Opens one file that holds only the declared voxels after declaration->header_bytes. STATUS_INVALID for more than
 * one file (field OPTION_RAW), an unknown type (OPTION_RAW_TYPE), edges that are not 1 .. VOXEL_STREAM_MAX_EDGE
 * (OPTION_RAW_SHAPE) and a header of over 2^63 bytes (OPTION_RAW_HEADER); else as voxel_stream_open. */
status raw_source_open(const char *const *path, size_t n_path, const struct volume_raw_declaration *declaration,
                       void **handle, struct volume_source_info *info, struct error *err);
status raw_source_read(void *handle, size_t i_slice, size_t n_slice, float *value, struct error *err);
void raw_source_close(void *handle);

#endif
