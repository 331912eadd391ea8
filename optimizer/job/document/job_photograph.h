/* A photograph of a job, and how its file becomes light. */
#ifndef SELVEDGE_OPTIMIZER_JOB_PHOTOGRAPH_H
#define SELVEDGE_OPTIMIZER_JOB_PHOTOGRAPH_H

#include "optimizer/job/document/job_limits.h"
#include "optimizer/job/document/picture_words.h"

#include <stdbool.h>
#include <stddef.h>

/* One more exposure of the view of a photograph. */
struct job_exposure {
    char file[JOB_MAX_NAME_BYTES];
    double exposure_s; /* NaN: as the file states */
};

/* Where the end of a cylinder's axis at +y shows in a picture; the axis lies within 45 degrees of this side. */
enum job_axis { JOB_AXIS_UP, JOB_AXIS_RIGHT, JOB_AXIS_DOWN, JOB_AXIS_LEFT };

/* A cylinder that the cloth of a photograph is wrapped on: axis parallel to y, the highest line of the cloth through
 * the orbit center (photographs/cylinder/cylinder_view.h). */
struct job_cylinder {
    double radius_mm; /* of the cloth's outer side; NaN or 0: the cloth is flat */
    enum job_axis axis;
    double edges_px[8];                    /* two points on each silhouette; NaN: found */
    double markers_px[8];                  /* the same by the markers of a rig; all 0: none */
    double step_deg, limit_deg, length_mm; /* length along the axis; NaN or 0: all of the crop */
};

/* A column of such a photograph, which the worker makes a photograph of its own of. */
struct job_column {
    size_t number, n;       /* from 1 on; 0: the photograph is no column. n: columns of the photograph */
    double angle_deg;       /* around the cylinder, from the highest line towards +x */
    double corner_px[4][2]; /* upper left, upper right, lower right, lower left of its picture, with the axis upwards */
    double angle_se_deg;    /* by the errors of the silhouettes */
    size_t view_px[4];      /* part of the photograph that holds all of its columns */
};

struct job_photograph {
    char file[JOB_MAX_NAME_BYTES];
    enum job_set set;
    double light_theta_deg, light_phi_deg, camera_theta_deg, camera_phi_deg, cloth_rotation_deg;
    double scale, weight;
    /* As given: a view of the rig (""), or places in mm from the orbit center (NaN). The angles follow from either. */
    char view[64];
    double light_position_mm[3], camera_position_mm[3];
    double light_distance_cm, camera_distance_cm; /* NaN: the document's */
    size_t crop_px[4];                            /* all 0: whole picture */
    double crop_exact_px[4];                      /* the same before rounding, where markers gave it; or all 0 */
    enum job_transfer transfer;
    bool transfer_assumed;                         /* nobody declared it: a curve that the file declares comes first */
    double exposure_s, iso, aperture, black_level; /* NaN: as the file states */
    size_t n_exposure;                             /* besides the first one, which is `file` */
    struct job_exposure *exposure;
    size_t index; /* in the list of the document */
    struct job_cylinder cylinder;
    struct job_column column;
};

/* Returns whether the photograph shows a cylinder whose columns have not been made yet. */
static inline bool job_photograph_is_cylinder(const struct job_photograph *p)
{
    return p->cylinder.radius_mm > 0.0 && p->column.number == 0;
}
/* The name of the row that the photograph makes: its file, of a column with the number before the ending. */
void job_photograph_name(const struct job_photograph *p, char name[JOB_MAX_NAME_BYTES]);

/* A photograph of the bowl of a single fiber. */
struct job_bowl_photograph {
    struct job_photograph picture;       /* members that belong to a view of the cloth are unused */
    char background[JOB_MAX_NAME_BYTES]; /* "": none */
    double theta_i_deg, phi_i_deg, fiber_turn_deg;
};

#endif
