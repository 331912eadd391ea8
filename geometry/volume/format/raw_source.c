#include "geometry/volume/format/raw_source.h"
#include "base/option_id.h"

#include "base/files/durable.h"
#include "geometry/volume/format/voxel_stream.h"

#include <endian.h>
#include <limits.h>
#include <string.h>

static bool sample_type_of_name(const char *name, enum sample_type *type)
{
    for (enum sample_type t = 0; t < SAMPLE_COUNT; t++)
        if (strcmp(name, sample_name(t)) == 0) {
            *type = t;
            return true;
        }
    return false;
}

status raw_source_open(const char *const *path, size_t n_path, const struct volume_raw_declaration *d, void **handle,
                       struct volume_source_info *info, struct error *err)
{
    struct voxel_layout layout = {.offset_bytes = (long long)d->header_bytes};
    struct voxel_stream *stream = NULL;
    if (n_path != 1)
        return error_set_field(err, STATUS_INVALID, OPTION_RAW,
                               "cannot read the volume: 'raw' describes one file, but %zu are given", n_path);
    if (!sample_type_of_name(d->type, &layout.sample))
        return error_set_field(err, STATUS_INVALID, OPTION_RAW_TYPE,
                               "cannot read volume '%s': unknown sample type '%s'", path_file_name(path[0]), d->type);
    for (int a = 0; a < 3; a++)
        if (d->n[a] == 0 || d->n[a] > VOXEL_STREAM_MAX_EDGE)
            return error_set_field(err, STATUS_INVALID, OPTION_RAW_SHAPE,
                                   "cannot read volume '%s': a shape of %zu x %zu x %zu voxels is not possible",
                                   path_file_name(path[0]), d->n[0], d->n[1], d->n[2]);
    if (d->header_bytes > LLONG_MAX) /* as an offset it would be negative */
        return error_set_field(err, STATUS_INVALID, OPTION_RAW_HEADER,
                               "cannot read volume '%s': a header of %zu bytes is not possible",
                               path_file_name(path[0]), d->header_bytes);
    memcpy(layout.n, d->n, sizeof layout.n);
    layout.swap = d->big_endian != (BYTE_ORDER == BIG_ENDIAN);
    status s = voxel_stream_open(path_file_name(path[0]), path[0], &layout, &stream, err);
    if (s == STATUS_OK) s = voxel_stream_check_order(stream, err);
    if (s != STATUS_OK) {
        voxel_stream_close(stream);
        return s;
    }
    *info = volume_source_info_empty();
    memcpy(info->n, d->n, sizeof info->n);
    info->sample = sample_name(layout.sample);
    *handle = stream;
    return STATUS_OK;
}

status raw_source_read(void *handle, size_t i_slice, size_t n_slice, float *value, struct error *err)
{
    return voxel_stream_read(handle, i_slice, n_slice, value, err);
}

void raw_source_close(void *handle) { voxel_stream_close(handle); }
