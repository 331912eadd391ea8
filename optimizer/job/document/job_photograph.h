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
};

/* A photograph of the bowl of a single fiber. */
struct job_bowl_photograph {
    struct job_photograph picture;       /* members that belong to a view of the cloth are unused */
    char background[JOB_MAX_NAME_BYTES]; /* "": none */
    double theta_i_deg, phi_i_deg, fiber_turn_deg;
};

#endif
