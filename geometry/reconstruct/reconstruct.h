/* The reconstruction of fibers from a scan, in the steps that the pipeline runs and checkpoints (fabric thesis,
 * section 5.6). Step functions take the options of the job and fill a part of the quality report.
 *
 * Volumes and all arrays of their size come from the scratch space given to reconstruct_read (v->space). The steps
 * process them in slabs and keep the process within its memory limit. Results do not depend on the limit. */
#ifndef SELVEDGE_GEOMETRY_RECONSTRUCT_H
#define SELVEDGE_GEOMETRY_RECONSTRUCT_H

#include "base/progress.h"
#include "base/thread_pool.h"
#include "base/warning.h"
#include "geometry/diameter/lumen_evidence.h"
#include "geometry/diameter/scan_densities.h"
#include "geometry/fibers/fiber_set.h"
#include "geometry/fibers/seam/fiber_seam.h"
#include "geometry/fibers/shape/radius.h"
#include "geometry/grade/scan_grade.h"
#include "geometry/grade/scan_trial.h"
#include "geometry/orientation/alignment.h"
#include "geometry/volume/format/volume_source.h"
#include "geometry/volume/tile_crop.h"
#include "geometry/volume/volume.h"

#include <stdbool.h>

/* Options of the reconstruction. NaN (or 0 for counts) means "choose from the data"; the chosen values are written
 * back. */
struct reconstruct_option {
    struct volume_raw_declaration raw; /* n[0] == 0 (default): the file has a header */
    double voxel_size_m[3];            /* required unless the file states it; NaN: take the file's */
    char axes[8];         /* which volume axis becomes cloth x, y, z: "xyz" (default), "xzy", "-zxy", ... */
    double matrix[9];     /* rotation/shear applied after `axes`, row-major; identity by default */
    size_t crop_voxel[6]; /* x0 y0 z0 x1 y1 z1 after the matrix; all 0: everything */
    bool align;           /* estimate the matrix (main_directions.h); a given matrix has precedence */
    bool crop;            /* choose the box that tiles best (tile_crop.h); a given box has precedence */
    double crop_keep;     /* least share of each edge that is kept, 0.5 by default */
    /* Scans with more voxels are cropped in z to what holds material (void_trim.h), unless a box or a matrix is given
     * or estimated, or voxels are not cubes: 2^30 by default. */
    size_t trim_above_voxel;
    double density_low, density_high; /* scanner values mapped to 0 and 1 */
    /* Whether lumens are filled when the volume is read (lumen_sift.h): 0, 1, or -1 (default) where the evidence is
     * clear; the decision is written back. */
    int hollow_fibers;
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

/* Whether the fibers are hollow. LUMENS_UNKNOWN: none were seen, and the scan would not show them. */
enum lumen_answer { LUMENS_GIVEN, LUMENS_FILLED, LUMENS_DOUBTFUL, LUMENS_NONE, LUMENS_UNKNOWN };
/* "given", "filled", "possible", "none" or "unknown". */
const char *lumen_answer_name(enum lumen_answer a);

/* What is reported with the result, in the units named. */
struct reconstruct_report {
    size_t n[3];
    double voxel_size_m[3];
    double file_voxel_size_m[3]; /* as stated in the file; NaN if it is not */
    struct main_directions main; /* main and align only with option "align" */
    struct alignment align;
    bool aligned;                             /* the estimated matrix was used; it is in the options */
    struct tile_crop tile;                    /* with option "crop" or if a matrix was used; else all zero */
    struct seam_density seam_density;         /* of the volume as used */
    struct fiber_seam seam_found, seam_fiber; /* of the fibers as found, and as used with their ends joined */
    struct seam_join seam_join;               /* all zero if they were not joined */
    double density_low, density_high;         /* scanner values */
    double separability;                      /* of void and material in the histogram, 0..1 (density_map.h) */
    struct scan_noise noise;                  /* of the scan, and after smoothing */
    double lumen_share;          /* enclosed void that is filled over material; 0 if the fibers are solid */
    bool lumens_found;           /* they were filled because the fibers look hollow */
    struct lumen_evidence lumen; /* whether the fibers look hollow */
    enum lumen_answer lumens;    /* LUMENS_GIVEN: the job says whether they are */
    bool lumens_measured;        /* each fiber has a lumen of its own with an error (fiber_shape.h) */
    double fiber_diameter_voxel; /* given, or measured from the volume before the filter */
    /* The peak that the measured diameter was preferred to (fiber_diameter.h), and the shares of noise in both; NaN if
     * there is none. Where the diameter was given: what the scan shows, if that differs by a factor of
     * FIBER_DIAMETER_FINER or more, and the shares are NaN. */
    double other_diameter_voxel, diameter_noise_share, other_diameter_noise_share;
    double trace_edge_voxel; /* edge of the voxels that fibers were found in, per voxel of the scan (trace_grid.h) */
    size_t n_material_voxel, n_kept_voxel; /* V >= eps_d; V >= eps_d and J <= eps_j */
    size_t n_class_voxel[3];               /* of the grid that fibers were found in, as the next */
    size_t n_center[3], n_chain[3], n_short_dropped[3];
    size_t n_gap_bridged, n_joined;
    size_t n_fiber, n_vertex;
    double total_length_m;
    double radius_m[3], radius_score[3];
    double radius_se_m[3]; /* standard error; NaN where the radius was given */
    /* Radius of the profile that was fitted to the axes: a second measurement, by the edges instead of the mass. */
    double profile_radius_m;
    double profile_blur_m;     /* standard deviation of the blur that the profile has: of the scan and of its voxels */
    double radius_spread;      /* standard deviation of the radii of single fibers over their mean, without errors */
    double single_radius_se_m; /* typical standard error of the radius of one fiber */
    double axis_ratio;         /* mean ratio of the axes of the sections, and its standard deviation between fibers */
    double axis_ratio_spread;
    /* Standard errors of the axes by the scan's noise (axis_fit.h): position and direction, one component. */
    double axis_position_se_m, axis_direction_se_rad;
    bool radius_per_axis;          /* each class has a radius of its own */
    double dice;                   /* overlap of fibers of radius r with kept voxels */
    struct scan_grade grade;       /* how clearly the scan shows the fibers; set by the caller of reconstruct_fibers */
    struct scan_trial trial;       /* with reconstruct_trial; else not made */
    double direction_noise_deg[2]; /* before and after the transfer (direction_noise.h) */
    double direction_change_mean_deg; /* between filtered and transferred directions */
    double axis_share[3];             /* of the voxels with a direction: those that run most along x, y, z */
};

/* Memory, or space in files, that all steps together need for a voxel of the scan. */
enum { SCAN_BYTES_PER_VOXEL = 22 };

/* Step "volume": reads the files, applies axes, matrix and crop, maps densities to [0, 1], and fills enclosed lumens.
 * Where any were filled, reconstruct_refill_lumens follows. path: as for volume_source_open_declared. space NULL:
 * memory without a limit. Errors name the file and the option that is wrong: STATUS_FORMAT (incomplete file, pages of
 * different size or depth), STATUS_INVALID (NaN voxels, constant, or empty: nothing above the threshold),
 * STATUS_CANCELLED, STATUS_NO_MEMORY, STATUS_DISK_FULL (scratch space; in all steps), STATUS_TOO_LARGE (the scan needs
 * more than the scratch space may hold, by SCAN_BYTES_PER_VOXEL). */
status reconstruct_read(const char *const *path, size_t n_path, struct reconstruct_option *o,
                        struct scratch_space *space, struct thread_pool *pool, const struct progress *progress,
                        struct volume *v, struct reconstruct_report *report, struct error *err);

/* The part of the step "volume" that looks for lumens and fills what is enclosed. v: densities in [0, 1]; report->noise
 * is known. STATUS_CANCELLED, STATUS_NO_MEMORY; with a scratch space also STATUS_DISK_FULL. */
status reconstruct_lumens(struct volume *v, struct reconstruct_option *o, struct thread_pool *pool,
                          struct reconstruct_report *report, struct error *err);
/* The part after it, where anything was filled: traces fibers, and where their diameters differ fills their inner parts
 * as well. Otherwise v stays as it is. Measures the seams of the volume anew. Errors as before. */
status reconstruct_refill_lumens(struct volume *v, const struct reconstruct_option *o, struct thread_pool *pool,
                                 const struct progress *progress, struct reconstruct_report *report, struct error *err);

/* Changes report->lumens from LUMENS_NONE to LUMENS_UNKNOWN where lumens would not have been seen
 * (lumen_evidence_would_show), and where the grade is GRADE_UNRESOLVED. v: as it was traced; report: with its grade. */
void reconstruct_tell_lumens(const struct volume *v, struct reconstruct_report *report);

/* Step "orientation": computes directions d from v by the line filter (orientation/line_filter.h), which starts from
 * the structure tensor and refines J locally. STATUS_INVALID when no voxel is kept: field OPTION_FILTER_DENSITY if
 * none is dense enough, else OPTION_FILTER_ANSWER. */
status reconstruct_orientation(const struct volume *v, struct reconstruct_option *o, struct thread_pool *pool,
                               const struct progress *progress, struct direction_volume *d,
                               struct reconstruct_report *report, struct error *err);

/* The part of the step "orientation" after it, in noisy scans (reconstruct_redirects): traces lines up to four times,
 * and voxels within a diameter of one take its direction. d stays as it is in other scans, where voxels are
 * interpolated, and where radii of lines differ so much that the scan does not resolve its fibers. Errors as those of
 * reconstruct_fibers. */
status reconstruct_redirect(const struct volume *v, struct direction_volume *d, const struct reconstruct_option *o,
                            struct thread_pool *pool, const struct progress *progress,
                            const struct reconstruct_report *report, struct error *err);
bool reconstruct_redirects(const struct reconstruct_report *report);

/* Step "fibers": subvolumes, fiber centers, linking, smoothing and radius. STATUS_INVALID when no fiber is found. */
status reconstruct_fibers(const struct volume *v, const struct direction_volume *d, struct reconstruct_option *o,
                          struct thread_pool *pool, const struct progress *progress, struct fiber_set *f,
                          struct reconstruct_report *report, struct error *err);

/* Optional part of the step "fibers": scans a phantom of the fibers f with the noise (its strength and its correlation)
 * and the blur of the scan v, reconstructs it, and writes into report->trial how well f is found again. At most
 * SCAN_TRIAL_VOXELS from the middle of the scan are tried. report: as filled by reconstruct_fibers. The phantom's
 * fibers have the radii, sections and lumens that were measured along f (grade/trial_fibers.h); sections that are no
 * ellipses, such as beans, become ellipses. What cannot be reconstructed is no error: the trial then is not made. */
status reconstruct_trial(const struct volume *v, const struct fiber_set *f, const struct reconstruct_option *option,
                         struct thread_pool *pool, const struct progress *progress, struct reconstruct_report *report,
                         struct error *err);

/* Step "directions": voxels within 2r of a polyline get its tangent as direction (thesis 5.6.7). */
status reconstruct_transfer(const struct fiber_set *f, struct direction_volume *d, struct thread_pool *pool,
                            const struct progress *progress, struct reconstruct_report *report, struct error *err);

/* Send warnings about everything a user should know about the geometry that does not stop the job. They depend only on
 * the report, so a report read from its file gives the same warnings. f: the fibers in use. */
void reconstruct_warn_volume(const struct reconstruct_option *o, const struct reconstruct_report *r,
                             const struct warning_sink *warn);
void reconstruct_warn_fibers(const struct reconstruct_report *r, const struct fiber_set *f,
                             const struct warning_sink *warn);

/* Draws slice i_slice perpendicular to axis (0 x, 1 y, 2 z) in grey, with red crosses where fibers cross it. y or z
 * points up, x or y to the right. *rgb has 3 bytes per pixel, *width x *height pixels; the caller frees it.
 * STATUS_INVALID, STATUS_NO_MEMORY. */
status reconstruct_slice_picture(const struct volume *v, const struct fiber_set *f, int axis, size_t i_slice,
                                 uint8_t **rgb, size_t *width, size_t *height, struct error *err);

#endif
