/* Raw samples without a header: the user declares what they are. x runs fastest, then y, then z. */
#ifndef SELVEDGE_GEOMETRY_RAW_SOURCE_H
#define SELVEDGE_GEOMETRY_RAW_SOURCE_H

#include "geometry/volume/volume_reader.h"

/* type: a name of sample_name ("uint8" ... "float64"). False for others. */
bool sample_type_of_name(const char *name, enum sample_type *type);

/* One file that holds declaration's voxels and nothing else after declaration->header_bytes. STATUS_INVALID, field "volume.raw",
 * for a type or shape that makes no sense or more than one file; STATUS_FORMAT for a length that does not fit. */
status raw_source_open(const char *const *path, size_t n_path, const struct volume_raw_declaration *declaration,
                       void **handle, struct volume_source_info *info, struct error *err);
status raw_source_read(void *handle, size_t i_slice, size_t n_slice, float *value, struct error *err);
void raw_source_close(void *handle);

#endif
