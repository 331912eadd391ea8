/* The chain from a scan to fibers, in the steps that the pipeline runs and checkpoints (fabric thesis, section 5.6).
 * Step functions take the options of the job and fill a part of the quality report.
 *
 * Memory: volumes and everything as large as they are come from the scratch space given to reconstruct_read (v->space); the steps
 * walk through them in slabs and keep the process within its limit. Results do not depend on the limit.
 */
#ifndef SELVEDGE_GEOMETRY_RECONSTRUCT_H
#define SELVEDGE_GEOMETRY_RECONSTRUCT_H

#include "base/progress.h"
#include "base/thread_pool.h"
#include "base/warning.h"
#include "geometry/fibers/fiber_seam.h"
#include "geometry/fibers/fiber_set.h"
#include "geometry/fibers/shape/radius.h"
#include "geometry/orientation/main_directions.h"
#include "geometry/volume/tile_crop.h"
#include "geometry/volume/volume.h"
#include "geometry/volume/volume_source.h"

#include <stdbool.h>

/* Options of geometry; NaN (or 0 for counts) means "choose from the data". Chosen values are written back. */
struct reconstruct_option {
    struct volume_raw_declaration raw; /* n[0] == 0 (default): the file has a header */
    double voxel_size_m[3];            /* required unless the file states it; NaN: take the file's */
    char axes[8];                     /* which volume axis becomes cloth x, y, z: "xyz" (default), "xzy", "-zxy", ... */
    double matrix[9];                 /* rotation/shear applied after `axes`, row-major; identity by default */
    size_t crop_voxel[6];             /* x0 y0 z0 x1 y1 z1 after the matrix; all 0: everything */
    bool align;                       /* estimate the matrix (main_directions.h); one that is given wins */
    bool crop;                        /* choose the box that tiles best (tile_crop.h); one that is given wins */
    double crop_keep;                 /* least share of its edges that is kept, 0.5 by default */
    double density_low, density_high; /* scanner values mapped to 0 and 1 */
    double s, t;                      /* filter widths, per square voxel (thesis Table 5.2) */
    size_t h;                         /* edge of the filter's cube, voxels */
    double eps_d, eps_j;
    double link_sigma_voxel;      /* 5 in the thesis */
    size_t min_vertex;            /* 10 in the thesis */
    double smooth_alpha;          /* 0.1 in the thesis */
    double radius_m[3];           /* per axis class; NaN: determine */
    enum radius_rule radius_rule; /* automatic by default (radius.h) */
};

void reconstruct_option_default(struct reconstruct_option *o);

/* What is reported with the result (values in the units named). */
struct reconstruct_report {
    size_t n[3];
    double voxel_size_m[3];
    double file_voxel_size_m[3]; /* as the file states it, NaN where it does not */
    struct main_directions main; /* with option "align" only, as the next */
    struct alignment align;
    bool aligned;                             /* the estimated matrix was used: it is in the options */
    struct tile_crop tile;                    /* with option "crop", or when a matrix was used; else all zero */
    struct seam_density seam_density;         /* of the volume that is used */
    struct fiber_seam seam_found, seam_fiber; /* of the fibers as found, and as used (ends joined) */
    size_t n_seam_joined;
    double density_low, density_high;      /* scanner values */
    double separability;                   /* of void and material in the histogram, 0..1 (density_map.h) */
    double noise_sd;                       /* of the mapped density, in material-free voxels */
    double fiber_diameter_voxel;           /* measured from the volume before the filter */
    size_t n_material_voxel, n_kept_voxel; /* V >= eps_d; and J <= eps_j as well */
    size_t n_class_voxel[3];
    size_t n_center[3], n_chain[3], n_short_dropped[3];
    size_t n_gap_bridged, n_joined;
    size_t n_fiber, n_vertex;
    double total_length_m;
    double radius_m[3], radius_score[3];
    double radius_se_m[3];            /* standard error; NaN where the radius was given */
    bool radius_per_axis;             /* one radius for each class */
    double dice;                      /* of fibers (radius r) against kept voxels */
    double direction_noise_deg[2];    /* direction_noise.h, before and after the transfer */
    double direction_change_mean_deg; /* between filtered and transferred directions */
};

/* Step "volume": read the file(s), honour axes/matrix/crop, map densities to [0, 1]. path: as for volume_source_open_declared. Errors name
 * the file and the option at fault: STATUS_FORMAT (truncated, pages of different size or depth), STATUS_INVALID (NaN voxels, empty: nothing
 * above the threshold, constant), STATUS_CANCELLED, STATUS_NO_MEMORY, STATUS_DISK_FULL (scratch space; the same for all steps). space NULL: memory, without a limit. */
status reconstruct_read(const char *const *path, size_t n_path, struct reconstruct_option *o,
                        struct scratch_space *space, struct thread_pool *pool, const struct progress *progress,
                        struct volume *v, struct reconstruct_report *report, struct error *err);

/* Step "orientation": the line filter (orientation/line_filter.h; structure tensor start, local refinement of J), v -> d.
 * STATUS_INVALID when no voxel is kept: field OPTION_FILTER_DENSITY when none is dense enough, else OPTION_FILTER_ANSWER. */
status reconstruct_orientation(const struct volume *v, struct reconstruct_option *o, struct thread_pool *pool,
                               const struct progress *progress, struct direction_volume *d,
                               struct reconstruct_report *report, struct error *err);

/* Step "fibers": decomposition, centers, linking, smoothing, radius. STATUS_INVALID when no fiber is found. */
status reconstruct_fibers(const struct volume *v, const struct direction_volume *d, struct reconstruct_option *o,
                          struct thread_pool *pool, const struct progress *progress, struct fiber_set *f,
                          struct reconstruct_report *report, struct error *err);

/* Step "directions": voxels within 2r of a polyline take its tangent (thesis 5.6.7). */
status reconstruct_transfer(const struct fiber_set *f, struct direction_volume *d, struct thread_pool *pool,
                            const struct progress *progress, struct reconstruct_report *report, struct error *err);

/* Warn of what a user should know about the geometry although it stops nothing. They depend on the report alone, so a report
 * that was read back gives the same warnings. f: the fibers in use. */
void reconstruct_warn_volume(const struct reconstruct_option *o, const struct reconstruct_report *r,
                             const struct warning_sink *warn);
void reconstruct_warn_fibers(const struct reconstruct_report *r, const struct fiber_set *f,
                             const struct warning_sink *warn);

/* Grey PNG-ready picture of slice i_slice perpendicular to axis (0 x, 1 y, 2 z) with the fibers crossing it marked as red
 * crosses; y or z points up, x or y to the right; rgb is 3 bytes a pixel, malloc'ed, width x height filled in. */
status reconstruct_slice_picture(const struct volume *v, const struct fiber_set *f, int axis, size_t i_slice,
                                 uint8_t **rgb, size_t *width, size_t *height, struct error *err);

#endif
