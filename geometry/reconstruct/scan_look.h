/* A first look at a scan: the range of its values, and its padding. Scanners and the programs that export their volumes
 * write one value where nothing was measured, such as -32768 outside of a round field of view. Such voxels are unknown;
 * they are no void. */
#ifndef SELVEDGE_GEOMETRY_SCAN_LOOK_H
#define SELVEDGE_GEOMETRY_SCAN_LOOK_H

#include "geometry/volume/format/volume_source.h"

enum { SCAN_PADDING_MAX = 3, SCAN_LOOK_SLICES = 16 };

struct scan_look {
    double least, most;  /* of the values that are no padding; least > most: there are none */
    bool has_unnumbered; /* some voxels besides padding are NaN or infinite */
    size_t n_padding;
    float padding[SCAN_PADDING_MAX]; /* may be NaN or infinite */
    double share[SCAN_PADDING_MAX];  /* of all voxels */
};

/* Reads up to SCAN_LOOK_SLICES slices, evenly from the first to the last. A value is padding where
 *  - it is NaN, infinite, or beyond all other values by 2 % of their spread (from the 1 % to the 99 % quantile), with
 *    at most a thousandth of them, the tail of the noise, nearer than a tenth of the spread,
 *  - at least 0.5 % and at most 95 % of the voxels have it,
 *  - it fills the ends of rows, columns and lines along z: of its voxels at most 2 %, and at most 0.5 % of the number
 *    of others, lie between others. A field of view is convex; void in cloth is not, so a clipped void is no padding.
 * The value that the file states as its padding needs no distance. Errors of reading; STATUS_NO_MEMORY. */
status scan_look_take(struct volume_source *source, struct scan_look *look, struct error *err);

/* Returns whether a value is padding. */
bool scan_look_is_padding(const struct scan_look *look, float value);

#endif
