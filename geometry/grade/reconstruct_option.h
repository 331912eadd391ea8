/* The options of a reconstruction (geometry/reconstruct). */
#ifndef SELVEDGE_GEOMETRY_RECONSTRUCT_OPTION_H
#define SELVEDGE_GEOMETRY_RECONSTRUCT_OPTION_H

#include "geometry/fibers/shape/radius.h"
#include "geometry/volume/format/volume_info.h"

#include <stdbool.h>

/* Options of the reconstruction. NaN (or 0 for counts) means "choose from the data"; the chosen values are written
 * back. */
struct reconstruct_option {
    struct volume_raw_declaration raw; /* n[0] == 0 (default): the file has a header */
    struct volume_part part;           /* of a file that has several channels or times */
    double voxel_size_m[3];            /* required unless the file states it; NaN: take the file's */
    char axes[8];         /* which volume axis becomes cloth x, y, z: "xzy", "-zxy", ...; "" (default): the file's */
    double matrix[9];     /* rotation/shear applied after `axes`, row-major; identity by default */
    size_t crop_voxel[6]; /* x0 y0 z0 x1 y1 z1 after the matrix; all 0: everything */
    bool align;           /* estimate the matrix (main_directions.h); a given matrix has precedence */
    bool crop;            /* choose the box that tiles best (tile_crop.h); a given box has precedence */
    double crop_keep;     /* least share of each edge that is kept, 0.5 by default */
    /* Scans with more voxels are cropped in z to what holds material (void_trim.h), unless a box or a matrix is given
     * or estimated, or voxels are not cubes: 2^30 by default. */
    size_t trim_above_voxel;
    double density_low, density_high; /* scanner values mapped to 0 and 1 */
    /* Whether lumens are filled when the volume is read (lumen_filter.h): 0, 1, or -1 (default) where the evidence is
     * clear; the decision is written back. */
    int hollow_fibers;
    bool three_subvolumes;       /* as published, in place of nine that overlap (slice_frame.h) */
    double fiber_diameter_voxel; /* typical diameter, from which scales and reaches follow */
    double s, t;                 /* filter widths, per square voxel (thesis Table 5.2) */
    size_t h;                    /* edge of the filter's cube, voxels */
    double eps_d, eps_j;
    double link_sigma_voxel;      /* 5 in the thesis */
    size_t min_vertex;            /* 10 in the thesis */
    double smooth_alpha;          /* 0.1 in the thesis */
    double radius_m[3];           /* per axis class; NaN: measure */
    enum radius_rule radius_rule; /* automatic by default (radius.h) */
};

void reconstruct_option_default(struct reconstruct_option *o);

#endif
