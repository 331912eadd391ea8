/* Plans the work of each stage of a job, in units whose speed can be remembered: voxels, paths, seconds of the fit. */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_PLAN_H
#define SELVEDGE_OPTIMIZER_PIPELINE_PLAN_H

#include "optimizer/report/report_work.h"
#include "optimizer/stages/fit_stages.h"

/* The state of a job as far as its plan goes. Nothing is owned. */
struct job_plan {
    const struct stage_tools *tools; /* folder and threads */
    struct worker_status *status;    /* that is told */
    const struct job_inputs *in;
    struct reconstruct_report geometry;         /* as far as it is known */
    const struct fit_output *fit;               /* its models are NULL before the fit */
    const struct validation_output *validation; /* its models are NULL before the validation */
    double stage_fraction;                      /* of the running stage, as last reported */
    double fit_path;      /* that the fits are expected to take, with the other work of their stage */
    double usual_wall_s;  /* of the whole job, by the speeds of a common machine (job_need.h) */
    double certificate_s; /* processor time of the gradient certificates, on one thread (plan_probe.h) */
    double inputs_s;      /* elapsed time of reading the inputs, which a job that runs takes again; 0 where it runs */
    double model_s[JOB_MAX_MODEL];   /* the same of each model */
    double profile_s[JOB_MAX_MODEL]; /* processor time of fitting each model to the profile of a fiber */
    double path_share;               /* time of a path in this cloth over that in a closed one */
    double file_segments;            /* of a given file of fibers, by its size; 0 without one */
    double report_s[REPORT_N_PART];  /* expected seconds of the parts of the report, once that stage is planned */
};

/* A plan of a job whose inputs have been read. */
void job_plan_init(struct job_plan *plan, const struct stage_tools *tools, const struct job_inputs *in);

/* Plans stage i, of this name (stage_table.h): before the first stage by the job document and the size of its files,
 * later by the outputs of earlier stages. */
void pipeline_plan_stage(struct job_plan *plan, const char *name, size_t i);
/* Plans the stage "volume", which runs, anew: the scan of n voxels has hollow fibers, which are traced to fill their
 * lumens. */
void pipeline_plan_hollow(struct job_plan *plan, const size_t n[3]);
/* Voxels of the scan: as read, or by the size of its files before. */
double pipeline_plan_voxels(const struct job_plan *plan);
/* Size of a cloth that is made from its description, 0 where the job has none: of each yarn, its fibers times the
 * square roots of the fibers of the yarns that it crosses, summed, because yarns are as far apart as they are thick; of
 * a felt, so much for each fiber. The vertices of the fibers go with it. With the tile of the last fit. */
double pipeline_plan_cloth_size(const struct job_plan *plan);
/* Light paths that the fit of one model of this job usually takes, by its rows and where they come from. */
double pipeline_plan_usual_paths(const struct job_plan *plan);
/* Plans the stages after the fit anew, whose work depends on the paths of the fits: n_path have been traced, and the
 * stage has reached plan->stage_fraction. */
void pipeline_plan_fit_paths(struct job_plan *plan, double n_path);

#endif
