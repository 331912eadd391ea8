/* A file with all slices of a scan across one axis, which a viewer reads a slice at a time.
 *
 * Every slice is kept in several levels, each half as wide and high as the one before, until it fits into a tile. A
 * level is cut into tiles, which are compressed one by one. So any slice is one read of some 100 kB that needs no other
 * slice, and a viewer takes no finer level than it can show. Scans of more than SLICE_MOST_VOXEL voxels are shrunk,
 * which bounds the file and the time that it takes: 2 bytes a voxel at most, and about 0.8 for real noise.
 * docs/file-formats.md has the byte layout.
 *
 * One file with bricks for all three axes would take a third of the space, but a slice across x would then need
 * hundreds of reads, or 32 times the bytes that it shows. */
#ifndef SELVEDGE_GEOMETRY_SLICE_TILES_H
#define SELVEDGE_GEOMETRY_SLICE_TILES_H

#include "geometry/volume/slice_codes.h"

enum { SLICE_TILE_EDGE = 1024, SLICE_MOST_VOXEL = 1 << 28 };

/* Writes the slices across `axis`: columns along x, or y for axis 0; rows along z, or y for axis 2, and the first row
 * at its low end. An incomplete file may remain after an error. STATUS_IO, STATUS_DISK_FULL, STATUS_NO_MEMORY,
 * STATUS_CANCELLED. */
status slice_tiles_write(const struct slice_codes *codes, int axis, struct thread_pool *pool,
                         const struct progress *progress, const char *path, struct error *err);

#endif
