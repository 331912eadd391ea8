/* Mitsuba grid volumes, `.vol` version 3 (byte layout: docs/file-formats.md). Bounding boxes are in millimetres.
 *
 * Written: density as float32 or uint8; direction as float32 x 3 or in two quantised bytes. Read back: the same four.
 * Other programs give density in [0, 1] and directions that are unit or exactly zero; so do the writers here.
 */
#ifndef SELVEDGE_GEOMETRY_VOL_FILE_H
#define SELVEDGE_GEOMETRY_VOL_FILE_H

#include "geometry/volume/volume.h"

#include <stdio.h>

enum vol_encoding { VOL_FLOAT32 = 1, VOL_UINT8 = 3, VOL_QUANTISED = 4 };

struct vol_header {
    enum vol_encoding encoding;
    size_t n[3];
    size_t n_channel;             /* 1 density, 3 direction (quantised directions, too) */
    float box_min[3], box_max[3]; /* as in the file: ours are millimetres */
    size_t bytes_per_voxel;
};

/* Files appear as a whole or not at all, written a slice at a time. STATUS_IO, STATUS_DISK_FULL, STATUS_NO_MEMORY; STATUS_INVALID for an
 * encoding that does not fit. */
status vol_write_density(const char *path, const struct volume *v, enum vol_encoding encoding, struct error *err);
status vol_write_direction(const char *path, const struct direction_volume *d, enum vol_encoding encoding,
                           struct error *err);
/* The densities of a direction volume (0 where emptied) as VOL_UINT8. */
status vol_write_kept_density(const char *path, const struct direction_volume *d, struct error *err);

/* Header at the start of file, checked against the file's length. name is used in errors. STATUS_FORMAT, STATUS_UNSUPPORTED (other encodings
 * and channels), STATUS_IO; the field of all errors of reading is OPTION_SCAN_FILES. */
status vol_read_header(FILE *file, const char *name, struct vol_header *header, struct error *err);
/* Density in one channel; the voxel size is taken from the box in millimetres (NaN for a box without extent). v: volume_release it. */
status vol_read_density(const char *path, struct volume *v, struct error *err);
/* Directions, 3 floats a voxel into direction[n_voxel*3] (malloc'ed), zero where there is no fiber. */
status vol_read_direction(const char *path, struct vol_header *header, float **direction, struct error *err);

/* Two bytes: theta = b0 pi/255, phi = b1 2 pi/255; b0 = 255 is "no fiber"; b1 = 255 is never written. Signs are free, so the
 * direction with z >= 0 is stored. Error: mean 0.36 degrees, worst 0.79. */
void vol_quantise_direction(const float d[3], uint8_t b[2]);
void vol_dequantise_direction(const uint8_t b[2], float d[3]);

#endif
