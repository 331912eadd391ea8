/* Units of length as scan files name them, and the statement of the size of a voxel. */
#ifndef SELVEDGE_GEOMETRY_LENGTH_UNIT_H
#define SELVEDGE_GEOMETRY_LENGTH_UNIT_H

#include "geometry/volume/format/volume_info.h"

/* Edge from which on a resolution in pixels per inch or centimetre is for prints, and no size of a voxel. */
#define MOST_PRINT_VOXEL_M 1e-4

/* Returns the metres of a unit, the n bytes at text: "um", "micron", "mm", "cm", "m", "nm", "inch" and their like, in
 * upper or lower case, in UTF-8, in Latin-1, or with ImageJ's escape for the letter mu. NaN for other words. */
double length_unit_m(const char *text, size_t n);

/* Sets info->voxel_size_m and enters it into the ledger. edge_m: NaN, 0 or infinite where the file does not state the
 * edge, which is then taken from a stated one, because scans have cubic voxels where nothing else is said. source: "",
 * or where the file states it, for the ledger. Does nothing where no edge is stated. */
void volume_state_voxel_size(struct volume_source_info *info, const double edge_m[3], const char *source);

#endif
