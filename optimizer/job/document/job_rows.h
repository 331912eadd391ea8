/* The sections "photographs" and "measurements" of a job document: the rows that models are fitted to. */
#ifndef SELVEDGE_OPTIMIZER_JOB_ROWS_H
#define SELVEDGE_OPTIMIZER_JOB_ROWS_H

#include "base/status.h"
#include "optimizer/job/document/job_limits.h"
#include "optimizer/job/document/picture_words.h"

#include <stddef.h>

struct job_photograph;

enum { JOB_MAX_MEASURED_ROW = 455 }; /* as many means over rotations as a table may have */

/* A configuration that is taken from a file of a measured BRDF. */
struct job_measured_row {
    enum job_set set;
    double light_theta_deg, light_phi_deg, camera_theta_deg, camera_phi_deg, cloth_rotation_deg;
};

struct job_rows {
    char measurement_file[JOB_MAX_NAME_BYTES]; /* "" when photographs are given */
    size_t n_measured_row;                     /* 0: the default ones; of files of measured BRDFs */
    struct job_measured_row *measured_row;
    enum job_symmetry measurement_symmetry;
    size_t n_photograph;
    struct job_photograph *photograph;
};

/* Angles and distance of a place in mm from the orbit center: x along the weft, y along the warp, z up. */
void job_angles_of_position(const double position_mm[3], double *theta_deg, double *phi_deg, double *distance_cm);

#endif
