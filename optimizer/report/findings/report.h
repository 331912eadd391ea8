/* The stage "report": everything under JOB/results. `struct report` is shared by the files of this folder: the input of
 * the stage, and its findings so far. */
#ifndef SELVEDGE_OPTIMIZER_REPORT_H
#define SELVEDGE_OPTIMIZER_REPORT_H

#include "optimizer/fit/baseline/plain_brdf.h"
#include "optimizer/fit/linear/next_photograph.h"
#include "optimizer/job/document/job_sections.h"
#include "optimizer/report/findings/program_helper.h"
#include "optimizer/report/findings/verdict.h"
#include "optimizer/stages/fit_stages.h"
#include "optimizer/stages/geometry_stages.h"
#include "renderer/estimate/derivative_check.h"

struct job_outline;
struct job_profile;
struct job_results;
struct job_rows;

/* Nothing is owned. */
struct report_input {
    const struct cloth_job *job; /* sections, rows and models */
    const char *sample;
    enum job_kind kind;
    const struct job_rows *photographs;
    const struct job_profile *profile;
    const struct job_results *results;
    const struct job_outline *files;  /* the input files */
    json_t *statements;               /* of these files (base/files/file_ledger_json.h) */
    const struct profile_rows *fiber; /* of a job with the profile of a fiber */
    const struct texture_guess *texture;
    const struct reconstruct_option *option;
    const struct model_fit *fit;
    const struct fitted_radius *radius;
    const struct validation *validation;
    struct made_cloth *made; /* made anew at the numbers of each model */
    struct program_helpers helper;
    size_t n_input_warning;     /* warnings of reading the job and of its geometry */
    const double *stage_wall_s; /* by index of the stage table; of this attempt, NaN for a stage of an earlier one */
    const double *work_s;       /* the expected seconds of each part of this stage (optimizer/report/report_work.h) */
};

struct report_output {
    struct verdict verdict; /* of the best model or, without a fit, of the geometry */
};
status stage_report(const struct report_input *in, struct report_output *out, struct error *err);
/* What is made after the result, while the service has nothing else to do: pictures/hero.png of the results, at first
 * from tables of few paths, and the twin. Goes on where an earlier attempt was interrupted. What the document asks for
 * itself is left out. Errors of surface_pictures_write and twin_result_write. */
status stage_pictures(const struct report_input *in, struct error *err);

/* A candidate for the next photograph. */
struct pipeline_candidate {
    size_t i_candidate; /* of the document */
    struct candidate_score score;
};

/* Two additions to the result of a model (findings.h). */
struct model_advice {
    struct derivative_check certificate;  /* of the free parameters at the result */
    struct pipeline_candidate *candidate; /* as many as the document has, best first; NULL when none were asked for */
};

/* A plain BRDF fitted to the same rows, and its errors (findings.h). */
struct pipeline_skill {
    bool measured; /* false where a row is lit by an environment too */
    struct plain_brdf brdf;
    double fit_rel_rms, heldout_rel_rms; /* NaN where that set has no rows */
    double left_out_rel_rms;             /* fitted rows by cross-validation; NaN with too few of them */
};

struct report {
    struct report_input in;
    size_t n_model;
    struct pipeline_model model[JOB_MAX_MODEL]; /* in the order of the document */
    struct model_advice *advice;                /* of each model */
    struct pipeline_skill skill;
    struct verdict verdict;
    json_t *exports;                     /* the files for other programs, as result.json lists them */
    json_t *surface_pictures;            /* the pictures of the cloth on surfaces, as result.json lists them */
    struct volume_output volume;         /* the scan; empty until report_need_volume */
    double part_from_s, part_from_cpu_s; /* when the running part of the stage began */
};

/* Returns the index of the best model: by pipeline_choice.h or, for the profile of a fiber, by profile_fit.bic. */
size_t report_best_model(const struct report *report);
/* Reads the scan from its checkpoint, if it is not in memory. */
status report_need_volume(struct report *report, struct error *err);

#endif
