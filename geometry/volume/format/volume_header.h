/* Common parts of the formats with a text header: the header's name, the layout of the voxels, and the file that holds
 * them. Errors have the field OPTION_SCAN_FILES and name the header. */
#ifndef SELVEDGE_GEOMETRY_VOLUME_HEADER_H
#define SELVEDGE_GEOMETRY_VOLUME_HEADER_H

#include "geometry/volume/format/voxel_stream.h"

enum { VOLUME_HEADER_MAX_BYTES = 65536 };

struct volume_header {
    char *name;      /* file name of the header, for errors */
    char *data_path; /* file of the voxels; NULL while it is not known */
    struct voxel_layout layout;
    struct voxel_stream *stream;
};

/* Takes the name of the header at `path`; the rest is zero. STATUS_NO_MEMORY. */
status volume_header_init(struct volume_header *h, const char *path, struct error *err);
void volume_header_release(struct volume_header *h);

/* STATUS_FORMAT: "cannot read volume 'scan.nrrd': PROBLEM 'VALUE'". */
status volume_header_refuse(const struct volume_header *h, const char *what, const char *value, struct error *err);
/* Reads n whole numbers from 1 to VOXEL_STREAM_MAX_EDGE, and returns in *end where they end. `complaint` begins the
 * error's text. STATUS_FORMAT. */
status volume_header_sizes(const struct volume_header *h, const char *value, size_t n, size_t *size,
                           const char *complaint, const char **end, struct error *err);
/* Sets data_path to `file` in the folder of the header. STATUS_UNSUPPORTED for lists of files; STATUS_FORMAT, with
 * `complaint`, for a file in another folder, because a header must not refer to files outside of its own. */
status volume_header_data_file(struct volume_header *h, const char *header_path, const char *file,
                               const char *complaint, struct error *err);
/* Opens the voxels and checks their byte order. Errors of voxel_stream.h. */
status volume_header_open_data(struct volume_header *h, struct error *err);

#endif
