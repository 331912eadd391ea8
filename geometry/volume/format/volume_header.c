#include "geometry/volume/format/volume_header.h"
#include "base/files/durable.h"
#include "base/option_id.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

status volume_header_init(struct volume_header *h, const char *path, struct error *err)
{
    *h = (struct volume_header){.name = strdup(path_file_name(path))};
    return h->name != NULL ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot read volume: out of memory");
}

void volume_header_release(struct volume_header *h)
{
    voxel_stream_close(h->stream);
    free(h->name);
    free(h->data_path);
    *h = (struct volume_header){0};
}

status volume_header_refuse(const struct volume_header *h, const char *what, const char *value, struct error *err)
{
    return error_set_field(err, STATUS_FORMAT, OPTION_SCAN_FILES, "cannot read volume '%s': %s '%.100s'", h->name, what,
                           value);
}

status volume_header_sizes(const struct volume_header *h, const char *value, size_t n, size_t *size,
                           const char *complaint, const char **end, struct error *err)
{
    const char *p = value;
    for (size_t a = 0; a < n; a++) {
        char *after;
        errno = 0;
        unsigned long long edge = strtoull(p, &after, 10);
        if (after == p || errno != 0 || edge == 0 || edge > VOXEL_STREAM_MAX_EDGE || strchr(value, '-') != NULL)
            return volume_header_refuse(h, complaint, value, err);
        size[a] = (size_t)edge;
        p = after;
    }
    *end = p;
    return STATUS_OK;
}

status volume_header_data_file(struct volume_header *h, const char *header_path, const char *file,
                               const char *complaint, struct error *err)
{
    if (strchr(file, '%') != NULL || strncmp(file, "LIST", 4) == 0)
        return error_set_field(err, STATUS_UNSUPPORTED, OPTION_SCAN_FILES,
                               "cannot read volume '%s': data in a list of files is not supported", h->name);
    if (strncmp(file, "./", 2) == 0) file += 2;
    if (strchr(file, '/') != NULL || file[0] == '\0') return volume_header_refuse(h, complaint, file, err);
    free(h->data_path);
    h->data_path = voxel_stream_beside(header_path, file);
    return h->data_path != NULL ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot read volume: out of memory");
}

status volume_header_open_data(struct volume_header *h, struct error *err)
{
    status s = voxel_stream_open(h->name, h->data_path, &h->layout, &h->stream, err);
    return s == STATUS_OK ? voxel_stream_check_order(h->stream, err) : s;
}
