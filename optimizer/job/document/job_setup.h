/* The sections of a job document that say how the cloth was lit and photographed: lamp, camera, rig, environment, black
 * sheet, and how the values of pictures become radiances. */
#ifndef SELVEDGE_OPTIMIZER_JOB_SETUP_H
#define SELVEDGE_OPTIMIZER_JOB_SETUP_H

#include "optimizer/job/document/job_photograph.h"

enum { JOB_MAX_DARK_FRAME = 256 };

struct job_setup {
    double lamp_side_cm, lamp_distance_cm, camera_distance_cm, crop_cm, camera_blur_mm;
    bool lamp_directional, camera_far_field;
    char rig_file[JOB_MAX_NAME_BYTES];   /* "" when none is given */
    char noise_file[JOB_MAX_NAME_BYTES]; /* record of the camera's noise; "" when none is given */
    size_t n_dark_frame;
    char (*dark_frame)[JOB_MAX_NAME_BYTES];
    /* From the camera's colors to radiances: by a photographed ColorChecker or by a white reference. Members of these
     * photographs that belong to a view of the cloth are unused. */
    bool has_color, has_chart, has_white;
    struct job_photograph chart, white;
    double chart_corner_px[8]; /* NaN: found in the picture */
    double chart_cloth_px[2];  /* place of the cloth in the chart's picture; NaN: the middle of the chart */
    bool chart_from_2014;      /* made in November 2014 or later */
    char chart_reference_file[JOB_MAX_NAME_BYTES]; /* colors of the patches; "": of a ColorChecker */
    double white_reflectance[3];
    double environment_rgb[3];
    char environment_file[JOB_MAX_NAME_BYTES]; /* "" when none is given */
    double environment_scale;
    bool black_sheet;
};

#endif
