/* Data sets of a foreign HDF5 file, read with nothing of other files: links to other files are never followed, and data
 * outside of the file, virtual data sets, and filters other than deflate, shuffle and Fletcher's sum are refused. */
#ifndef SELVEDGE_GEOMETRY_HDF5_FILE_H
#define SELVEDGE_GEOMETRY_HDF5_FILE_H

#include "base/status.h"
#include "geometry/volume/format/sample_type.h"

#include <hdf5.h>
#include <stdint.h>

enum { HDF5_MAX_DIMENSION = 5, HDF5_MAX_NAME_BYTES = 128 };

struct hdf5_file {
    const char *name; /* of the file, for errors; the caller keeps it */
    hid_t file, set, space;
    char set_name[HDF5_MAX_NAME_BYTES];
    bool is_only;                       /* the one data set that can be a scan was taken */
    size_t n, size[HDF5_MAX_DIMENSION]; /* the slowest first */
    enum sample_type sample;
};

/* Opens the data set `wanted`; NULL or "": the only one that has three to five dimensions of more than one voxel.
 * STATUS_FORMAT, STATUS_UNSUPPORTED; STATUS_INVALID with the field OPTION_SCAN_DATASET: there are several, or not this
 * one; the text lists the names. Close it in every case. */
status hdf5_file_open(struct hdf5_file *h, const char *path, const char *wanted, struct error *err);
void hdf5_file_close(struct hdf5_file *h);
/* Returns how many chunks of the data set were never written: their samples read as its fill value. */
uint64_t hdf5_file_missing_chunks(const struct hdf5_file *h);
/* Reads `count` samples from `start` on, in each dimension, as floats. STATUS_FORMAT. */
status hdf5_file_read(struct hdf5_file *h, const hsize_t *start, const hsize_t *count, float *value, struct error *err);

#endif
