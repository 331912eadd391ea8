/* The stages "fit" and "validation", and the fit of a job with the profile of a single fiber. */
#ifndef SELVEDGE_OPTIMIZER_FIT_STAGES_H
#define SELVEDGE_OPTIMIZER_FIT_STAGES_H

#include "optimizer/fit/baseline/discrepancy_fit.h"
#include "optimizer/fit/objective/noisy_minimum.h"
#include "optimizer/fit/profile/profile_fit.h"
#include "optimizer/stages/made_cloth.h"

/* Relative RMS errors of a fit to the fibers without the job's corrections (pipeline_correction.h). */
struct uncorrected_errors {
    bool measured;
    double fit_rel_rms, heldout_rel_rms, heldout_rel_rms_se; /* NaN where that set has no rows */
};

/* The part of the parameters' errors that comes from the errors of scanned fibers (pipeline_scan_error.h). */
struct scan_error {
    double radius_rel_se, direction_se_rad; /* of the fibers; direction 0: no errors were carried */
    double se_param[FIT_MAX_PARAM];         /* their part of the standard errors, internal units */
    struct uncorrected_errors uncorrected;
};

/* The result of a model's fit. */
struct model_fit {
    struct fit_result result;
    struct cloth_search_result cloth; /* when numbers of the cloth are fitted; `result` is its part without them */
    struct scan_error scan_error;
    struct profile_fit profile; /* of a job with the profile of a fiber; `result` has its parameters and errors */
};

/* The result of the search for the fiber radius (pipeline_radius.h). */
struct fitted_radius {
    size_t i_model, n_step;         /* the model that was fitted at each radius; records of the series */
    double start_m, radius_m, se_m; /* mean radius before and after; its standard error */
    double lower_m, upper_m;
    struct noisy_minimum curve; /* u = ln of the radius in metres; f: objective of the fit there */
    uint64_t n_path;
    double wall_s;
};

struct fit_input {
    const struct cloth_job *job;
    double usual_path;       /* that the fit of one model usually takes */
    struct made_cloth *made; /* made anew at the fitted radius */
};
struct fit_output {
    struct model_fit *model;     /* one for each model of the job */
    struct fitted_radius radius; /* when the job has the radius fitted */
};
status stage_fit(const struct fit_input *in, struct fit_output *out, struct error *err);
status stage_fit_load(const struct fit_input *in, struct fit_output *out, struct error *err);

struct profile_fit_input {
    const struct stage_tools *tools;
    const struct job_fit *fit;
    const struct job_profile *asked;
    const struct profile_rows *fiber;
    size_t n_model;
    const struct model_setup *model;
    const double *expected_s; /* of the fit of each model, all positive */
};
/* The stage "fit" of a job with the profile of a fiber; it stores nothing and always runs. */
status stage_profile_fit(const struct profile_fit_input *in, struct fit_output *out, struct error *err);

/* The smooth factor on the renderings of a model's cloth (pipeline_discrepancy.h), and relative RMS errors without
 * it. */
struct model_discrepancy {
    struct discrepancy factor;
    double fit_rel_rms, heldout_rel_rms; /* NaN where that set has no rows */
};

/* Fresh estimates at the fitted parameters: two replicas of every observation, in the order of `observation`. */
struct validation {
    struct estimate *replica[2];
    struct estimate *contrast[2];         /* of measured_rows.contrast, one per observation; NULL without contrasts */
    struct objective_value fit, held_out; /* held_out: NaN when there are no held-out rows */
    struct objective_value fit_with_gains,
        held_out_with_gains; /* with one gain per row; NaN unless the job asks for gains */
    struct objective_channels fit_channels, held_out_channels; /* NaN without such rows */
    /* largest standard error of a rendered mean (both replicas), relative to the row's brightness */
    double worst_rel_se;
    struct model_discrepancy discrepancy;
};

/* A model with the outputs of its stages; those that have not run are NULL. */
struct pipeline_model {
    const struct model_setup *setup;
    const struct model_fit *fit;
    const struct validation *validation;
    const struct model_advice *advice; /* report.h */
};

struct validation_input {
    const struct cloth_job *job;
    const struct model_fit *fit;
    struct made_cloth *made; /* made anew at the numbers of each model */
};
struct validation_output {
    struct validation *model;
};
status stage_validation(const struct validation_input *in, struct validation_output *out, struct error *err);
status stage_validation_load(const struct validation_input *in, struct validation_output *out, struct error *err);

/* The fit of a job that fits nothing: the parameters are those that the document holds fixed. STATUS_NO_MEMORY. */
status fit_output_given(const struct job_inputs *in, struct fit_output *out, struct error *err);
/* The validation of that job: radiances and smooth factor are taken from the result that it was given. Nothing happens
 * without one. STATUS_NO_MEMORY. */
status validation_output_given(const struct job_inputs *in, struct validation_output *out, struct error *err);
void fit_output_release(struct fit_output *out, size_t n_model);
void validation_output_release(struct validation_output *out, size_t n_model);

#endif
