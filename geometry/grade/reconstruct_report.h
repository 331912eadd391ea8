/* The report of a reconstruction, which every step of it fills a part of (geometry/reconstruct). */
#ifndef SELVEDGE_GEOMETRY_RECONSTRUCT_REPORT_H
#define SELVEDGE_GEOMETRY_RECONSTRUCT_REPORT_H

#include "geometry/diameter/light_material.h"
#include "geometry/diameter/lumen_evidence.h"
#include "geometry/diameter/scan_densities.h"
#include "geometry/fibers/seam/fiber_seam.h"
#include "geometry/fibers/tiles/fiber_tiles.h"
#include "geometry/grade/fiber_kinds.h"
#include "geometry/grade/scan_grade.h"
#include "geometry/grade/scan_trial.h"
#include "geometry/orientation/alignment.h"
#include "geometry/volume/tile_crop.h"

#include <stdbool.h>

/* Whether the fibers are hollow. LUMENS_UNKNOWN: none were seen, and the scan would not show them. */
enum lumen_answer { LUMENS_GIVEN, LUMENS_FILLED, LUMENS_DOUBTFUL, LUMENS_NONE, LUMENS_UNKNOWN };
/* "given", "filled", "possible", "none" or "unknown". */
const char *lumen_answer_name(enum lumen_answer a);

/* Figures that are reported with the result, in the units of their names. */
struct reconstruct_report {
    size_t n[3];
    double voxel_size_m[3];
    double file_voxel_size_m[3]; /* as stated in the file; NaN if it is not */
    bool has_padding;            /* parts of the scan are unknown (scan_look.h) */
    bool is_all_padded;          /* so many that no column of the tile is known; tile is then all zero */
    struct main_directions main; /* main and align only with option "align" */
    struct alignment align;
    bool aligned;                             /* the estimated matrix was used; it is in the options */
    struct tile_crop tile;                    /* with option "crop" or if a matrix was used; else all zero */
    struct seam_density seam_density;         /* of the volume as used */
    struct fiber_seam seam_found, seam_fiber; /* of the fibers as found, and as used with their ends joined */
    struct seam_join seam_join;               /* all zero if they were not joined */
    struct fiber_tiles tiles;                 /* of the large tile; n_move 0: none was asked for */
    double density_low, density_high;         /* scanner values */
    double separability;                      /* of void and material in the histogram, 0..1 (density_map.h) */
    struct light_material light;              /* fibers that were raised to the density of others */
    struct scan_noise noise;                  /* of the scan, and after smoothing */
    double lost_ends;            /* share of the ends of lines in boxes (trace_diameter.h) that lie within material */
    bool in_pieces;              /* so many that lines are traced once more, where that is no worse in the box */
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
    size_t n_class_voxel[3];               /* this and the next member: of the grid in which fibers were found */
    size_t n_center[3], n_chain[3], n_short_dropped[3];
    size_t n_gap_bridged, n_joined;
    size_t n_fiber, n_vertex;
    double total_length_m;
    double radius_m[3], radius_score[3];
    double radius_se_m[3]; /* standard error that all fibers share; NaN where the radius was given */
    /* Radius of the profile that was fitted to the axes: a second measurement, by the edges instead of the mass. */
    double profile_radius_m;
    double profile_blur_m;     /* standard deviation of the blur that the profile has: of the scan and of its voxels */
    double radius_spread;      /* standard deviation of the radii of single fibers over their mean, without errors */
    double single_radius_se_m; /* typical standard error of the radius of one fiber */
    double axis_ratio;         /* mean ratio of the axes of the sections, and its standard deviation between fibers */
    double axis_ratio_spread;
    /* Standard errors of the axes, one component: position, and direction (axis_error.h). After tracing that of the
     * position is axis_noise_se_m; reconstruct_grade adds what the contact of blurred fibers does. */
    double axis_position_se_m, axis_direction_se_rad;
    struct fiber_kinds kinds;      /* set by reconstruct_grade */
    bool radius_per_axis;          /* each class has a radius of its own */
    double dice;                   /* overlap of fibers of radius r with kept voxels */
    struct scan_grade grade;       /* how clearly the scan shows the fibers; set by the caller of reconstruct_fibers */
    struct scan_trial trial;       /* with reconstruct_trial; else not made */
    double direction_noise_deg[2]; /* before and after the transfer (direction_noise.h) */
    double direction_change_mean_deg; /* between filtered and transferred directions */
    double axis_share[3];             /* of the voxels with a direction: those that run most along x, y, z */
    double axis_noise_se_m;           /* standard error of the axes' position by noise and model (axis_error.h) */
};

#endif
