/* The voxels of a format with header and data: plain or deflated (gzip, zlib) samples in a file from some offset on,
 * read slice by slice. Deflated data is inflated while it is read forwards; reading backwards starts again. A stream
 * may be used by one thread at a time. Errors have the field OPTION_SCAN_FILES. */
#ifndef SELVEDGE_GEOMETRY_VOXEL_STREAM_H
#define SELVEDGE_GEOMETRY_VOXEL_STREAM_H

#include "base/status.h"
#include "geometry/volume/format/sample_type.h"

/* Several volumes in one file: `n` of them; number i is read. 0 counts as 1. */
struct voxel_parts {
    size_t n, i;
};

struct voxel_layout {
    size_t n[3]; /* 1 .. VOXEL_STREAM_MAX_EDGE each */
    /* Volumes whose samples alternate, whose slices alternate, and that lie behind one another. */
    struct voxel_parts by_sample, by_slice, by_volume;
    enum sample_type sample;
    bool swap; /* the byte order is opposite to the machine's */
    bool compressed;
    long long offset_bytes; /* of the data in the file; -1: plain data at the end of the file */
    long long skip_bytes;   /* bytes before the first voxel, after inflating */
};

enum { VOXEL_STREAM_MAX_EDGE = 1 << 20 };

struct voxel_stream;

/* name: of the header, for errors. Compares the stated size with the size of the file: STATUS_FORMAT if the file is too
 * short, or longer by a row or more. Both mean a wrong shape or type, and the text names the types that would fit.
 * STATUS_NOT_FOUND, STATUS_IO, STATUS_TOO_LARGE (a slice over 4 GiB). */
status voxel_stream_open(const char *name, const char *data_path, const struct voxel_layout *layout,
                         struct voxel_stream **stream, struct error *err);
void voxel_stream_close(struct voxel_stream *stream);
/* Reads slices i_slice .. i_slice + n_slice - 1 to value[n_slice][rows][columns]. */
status voxel_stream_read(struct voxel_stream *stream, size_t i_slice, size_t n_slice, float *value, struct error *err);
/* STATUS_FORMAT if the middle slice is noise in the stated byte order (correlation of neighbours below 0.1) and a
 * picture in the other (above 0.5). Deflated data, and slices too small for this test, pass. */
status voxel_stream_check_order(struct voxel_stream *stream, struct error *err);

/* Returns the path of `file` in the folder of header_path; the caller frees it. NULL if memory is out. */
char *voxel_stream_beside(const char *header_path, const char *file);

#endif
