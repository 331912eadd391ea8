/* Mitsuba grid volumes, `.vol` version 3 (byte layout: docs/file-formats.md). Bounding boxes are in millimetres.
 * Density is written as float32 or uint8, and direction as float32 x 3 or in two quantised bytes; these four can be
 * read. Flakes about the directions are written only, for Mitsuba's phase function `sggx`. As in files of other
 * programs, density is in [0, 1] and directions are unit vectors or exactly zero. */
#ifndef SELVEDGE_GEOMETRY_VOL_FILE_H
#define SELVEDGE_GEOMETRY_VOL_FILE_H

#include "geometry/volume/volume.h"

#include <stdio.h>

enum vol_encoding { VOL_FLOAT32 = 1, VOL_UINT8 = 3, VOL_QUANTISED = 4 };

struct vol_header {
    enum vol_encoding encoding;
    size_t n[3];
    size_t n_channel;             /* 1: density; 3: direction, also if quantised */
    float box_min[3], box_max[3]; /* as in the file; in millimetres if this program wrote it */
    size_t bytes_per_voxel;
};

/* Writes a file slice by slice; it appears complete or not at all. STATUS_INVALID for an encoding that does not fit,
 * STATUS_IO, STATUS_DISK_FULL, STATUS_NO_MEMORY. */
status vol_write_density(const char *path, const struct volume *v, enum vol_encoding encoding, struct error *err);
status vol_write_direction(const char *path, const struct direction_volume *d, enum vol_encoding encoding,
                           struct error *err);
/* Six channels, float32: S = I - (1 - along^2) t t' as xx, yy, zz, xy, xz, yz, of the fiber direction t. A flake
 * distribution with this matrix has the projected area sqrt(w' S w) (Heitz, Dupuy, Crassin, Dachsbacher 2015, "The SGGX
 * microflake distribution", section 3): the area of a cylinder for along = 0; in the direction of the fiber it is
 * `along` times the area across. S = I where there is no fiber, so that samples between voxels have a matrix, too. 0 <
 * along <= 1. */
status vol_write_sggx(const char *path, const struct direction_volume *d, double along, struct error *err);
/* Writes the densities of a direction volume, 0 where emptied, as VOL_UINT8. */
status vol_write_kept_density(const char *path, const struct direction_volume *d, struct error *err);

/* Reads the header at the start of file and checks it against the length of the file. name is used in errors.
 * STATUS_FORMAT, STATUS_UNSUPPORTED (other encodings and channels), STATUS_IO. All errors of reading have the field
 * OPTION_SCAN_FILES. */
status vol_read_header(FILE *file, const char *name, struct vol_header *header, struct error *err);
/* Reads density in one channel. The voxel size comes from the box in millimetres; NaN for a box without extent. The
 * caller calls volume_release. */
status vol_read_density(const char *path, struct volume *v, struct error *err);
/* Reads directions, 3 floats per voxel, zero where there is no fiber. The caller frees *direction. */
status vol_read_direction(const char *path, struct vol_header *header, float **direction, struct error *err);

/* Two bytes: theta = b0 pi/255, phi = b1 2 pi/255. b0 = 255 means "no fiber"; b1 = 255 is never written. The sign of
 * a direction has no meaning, so the one with z >= 0 is stored. The error is 0.36 degrees on average and at most
 * 0.79. */
void vol_quantise_direction(const float d[3], uint8_t b[2]);
void vol_dequantise_direction(const uint8_t b[2], float d[3]);

#endif
