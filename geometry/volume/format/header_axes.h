/* The axes of a file with a text header: three of space, and others for channels and times, in any order that a scan
 * can be read in. */
#ifndef SELVEDGE_GEOMETRY_HEADER_AXES_H
#define SELVEDGE_GEOMETRY_HEADER_AXES_H

#include "geometry/volume/format/volume_header.h"
#include "geometry/volume/format/volume_part.h"

enum { HEADER_MAX_AXIS = 6 };
enum header_axis_kind { AXIS_UNKNOWN, AXIS_SPACE, AXIS_CHANNEL, AXIS_TIME, AXIS_COLOR };

struct header_axes {
    size_t n; /* axes, the fastest first */
    size_t size[HEADER_MAX_AXIS];
    enum header_axis_kind kind[HEADER_MAX_AXIS];
    bool has_direction;                   /* the axes of space have directions */
    double direction[HEADER_MAX_AXIS][3]; /* of any length above 0 */
    double spacing_m[HEADER_MAX_AXIS];    /* NaN: not stated */
    const char *source;                   /* where the file says so: "'kinds' of its header" */
};

/* Sets the layout of h, and size, voxel size and axes of info, with their statements. STATUS_FORMAT for axes that are
 * no scan (colors, fewer than three of space, an order that cannot be read); as volume_part_choose. */
status header_axes_settle(const struct header_axes *axes, struct volume_header *h, const struct volume_part *part,
                          struct volume_source_info *info, struct error *err);

/* Sets the matrix that straightens oblique axes (volume_align.h), row by row, from their directions. */
void header_axes_matrix(double direction[3][3], double matrix[9]);

#endif
