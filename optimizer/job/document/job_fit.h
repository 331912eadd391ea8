/* The section "fit" of a job document: the models, and how they are fitted. */
#ifndef SELVEDGE_OPTIMIZER_JOB_FIT_H
#define SELVEDGE_OPTIMIZER_JOB_FIT_H

#include "base/status.h"
#include "optimizer/job/document/job_fit_option.h"
#include "optimizer/job/document/job_limits.h"

#include <stdbool.h>
#include <stdint.h>

enum {
    JOB_MAX_CANDIDATE = 1024,
    JOB_MAX_TEXTURE_CELLS = 32 /* blocks along the edge of a crop; the renderer has the same limit */
};

/* One model to be fitted. */
struct job_model {
    char id[64];
    double fixed[JOB_MAX_PARAM], start[JOB_MAX_PARAM]; /* file units, one value for each parameter; NaN: not given */
    struct job_fit_option option;
    int first_free; /* the first parameter that neither "fixed" nor "tied" holds; -1: all are held */
};

/* A configuration that might be photographed. */
struct job_candidate {
    double light_theta_deg, light_phi_deg, camera_theta_deg, camera_phi_deg, cloth_rotation_deg;
};

struct job_fit {
    size_t n_model;
    struct job_model model[JOB_MAX_MODEL];
    char method[64];
    uint64_t seed;
    size_t max_iteration; /* 0: the method's default */
    uint64_t path_budget; /* 0: the method's default */
    double precision;     /* noise of tracing over the photographs' errors at which the fit ends; 0: none */
    char
        profile_job[JOB_MAX_ID_BYTES]; /* id of a job with a profile, whose results are priors; "" when none is given */
    char result_file[JOB_MAX_NAME_BYTES]; /* result.json of the job whose parameters are shown; "" when none is given */
    bool share_camera_paths;
    double plain_prior; /* strength; 0: none */
    bool discrepancy;
    /* The density multiplier is the last parameter of a volume model. Its entries in job_model.fixed and
     * job_model.start follow from the next two members. */
    double density_multiplier_per_cm; /* NaN: the model's default */
    bool fit_density;
    bool fit_radius;
    double radius_lower_um, radius_upper_um; /* NaN: from the cloth */
    double texture_block_mm, texture_weight; /* texture_block_mm 0: no texture */
    size_t n_candidate;                      /* for the next photograph; 0: none are ranked */
    bool candidate_grid;                     /* true: the candidates are the built-in ones */
    struct job_candidate *candidate;
};

struct param_info;
/* Bounds, start and fixed flag of each parameter of a model, with ties, bounds and priors taken into account. out has
 * n_param elements; all of them may be fixed. Returns STATUS_INVALID with the field at fault when they contradict each
 * other. */
status job_fit_resolve(const struct param_info *info, size_t n_param, const struct job_model *given,
                       struct job_fit_parameter *out, struct error *err);

/* Number of blocks along the edge of a crop of crop_cm whose means are compared. Needs block_mm > 0. */
size_t job_texture_cells(double crop_cm, double block_mm);
/* Edge of these blocks in mm. It is near to block_mm, which need not divide the crop. */
double job_texture_cell_mm(double crop_cm, double block_mm);

/* Sets and returns the error of a job that fits the density although no fitted row is lit from behind. */
status job_density_undetermined(bool black_sheet, struct error *err);

#endif
