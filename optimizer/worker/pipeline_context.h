/* What the stages of a job share: their inputs, their products, the log and the status. One thread runs the stages,
 * and each stage uses the thread pool. Ownership: pipeline_context_init/release; the context owns its members unless
 * a comment says otherwise. */
#ifndef SELVEDGE_OPTIMIZER_PIPELINE_CONTEXT_H
#define SELVEDGE_OPTIMIZER_PIPELINE_CONTEXT_H

#include "base/catalogue/model_sets.h"
#include "base/files/scratch_space.h"
#include "base/log.h"
#include "base/progress.h"
#include "base/thread_pool.h"
#include "geometry/cloth/cloth.h"
#include "geometry/fibers/fiber_set.h"
#include "geometry/reconstruct.h"
#include "geometry/volume/volume.h"
#include "geometry/weave/weave_detect.h"
#include "optimizer/fit/baseline/expected_rows.h"
#include "optimizer/fit/baseline/plain_brdf.h"
#include "optimizer/fit/cloth/cloth_search.h"
#include "optimizer/fit/descent/descent.h"
#include "optimizer/fit/objective/next_photograph.h"
#include "optimizer/fit/objective/noisy_minimum.h"
#include "optimizer/fit/photographs/camera/photograph_develop.h"
#include "optimizer/fit/photographs/observation.h"
#include "optimizer/fit/profile/bowl/bowl_profile.h"
#include "optimizer/fit/profile/profile_fit.h"
#include "optimizer/fit/verdict/verdict.h"
#include "optimizer/job/document/job_document.h"
#include "optimizer/job/stage_table.h"
#include "optimizer/worker/worker_folder.h"
#include "optimizer/worker/worker_status.h"
#include "renderer/scattering/appearance.h"
#include "renderer/scene/scene.h"
#include "renderer/transport/derivative_check.h"

#include <jansson.h>
#include <sys/types.h>

/* Fresh estimates at the fitted parameters: two replicas of every observation, in the order of `observation`. */
struct validation {
    struct estimate *replica[2];
    struct estimate *contrast[2]; /* of pipeline_context.contrast, one per observation; NULL without contrasts */
    struct objective_value fit, held_out; /* held_out: NaN when there are no held-out rows */
    struct objective_value fit_with_gains,
        held_out_with_gains; /* with one gain per row; NaN unless the job asks for gains */
    struct objective_channels fit_channels, held_out_channels; /* NaN without such rows */
    /* largest standard error of a rendered mean (both replicas), relative to the row's brightness */
    double worst_rel_se;
};

/* A candidate for the next photograph. */
struct pipeline_candidate {
    size_t i_candidate; /* of the document */
    struct candidate_score score;
};

/* Relative RMS errors of a fit to the fibers without the job's corrections (pipeline_correction.h). */
struct pipeline_uncorrected {
    bool measured;
    double fit_rel_rms, heldout_rel_rms, heldout_rel_rms_se; /* NaN without rows of that set */
};

/* What the errors of scanned fibers add to those of the parameters (pipeline_scan_error.h). */
struct pipeline_scan_error {
    double radius_rel_se, direction_se_rad; /* of the fibers; direction 0: no errors were carried */
    double se_param[FIT_MAX_PARAM];         /* their part of the standard errors, internal units */
    struct pipeline_uncorrected uncorrected;
};

/* The smooth factor on the renderings of a model's cloth (pipeline_discrepancy.h), and relative RMS errors without
 * it. */
struct pipeline_discrepancy {
    struct discrepancy factor;
    double fit_rel_rms, heldout_rel_rms; /* NaN without rows of that set */
};

/* One model of the job: its parameters, and the results of its fit. */
struct pipeline_model {
    struct appearance appearance;
    struct model_sets sets; /* its parameters: one set, or one for each group of fibers */
    struct fit_parameter parameter[FIT_MAX_PARAM];
    const struct job_fit_option *option; /* of the document */
    struct fit_result fit;
    struct cloth_search_result cloth; /* when numbers of the cloth are fitted; `fit` is its part without the numbers */
    struct pipeline_scan_error scan_error;
    struct profile_fit profile; /* of a job with the profile of a fiber; `fit` has its parameters and errors */
    struct validation validation;
    struct pipeline_discrepancy discrepancy;
    struct derivative_check certificate;  /* of the free parameters at the result; filled in before the report */
    struct pipeline_candidate *candidate; /* doc->n_candidate of them, best first; NULL when none were asked for */
};

/* The result of the search for the fiber radius (pipeline_radius.h). */
struct pipeline_radius {
    size_t i_model, n_step;         /* the model that was fitted at each radius; records of the series */
    double start_m, radius_m, se_m; /* mean radius before and after; its standard error */
    double lower_m, upper_m;
    struct noisy_minimum curve; /* u = ln of the radius in metres; f: objective of the fit there */
    uint64_t n_path;
    double wall_s;
};

/* The numbers of the cloth that are fitted together with the scattering parameters (pipeline_cloth.h). Values are in
 * the units of files. */
struct pipeline_numbers {
    size_t n; /* 0: the cloth is taken as it is */
    struct param_info info[CLOTH_MAX_FITTED];
    struct fit_parameter range[CLOTH_MAX_FITTED];
    struct pipeline_number {
        const char *unit;
        size_t index;                /* of the number in the description of the cloth */
        double prior_mean, prior_sd; /* NaN: no prior */
    } item[CLOTH_MAX_FITTED];
    size_t i_shown; /* model whose cloth is in `fiber` and `scene`, plus 1; 0: that of the start values */
    double shown[CLOTH_MAX_NUMBER]; /* all numbers of that cloth; unset while i_shown is 0 */
};

/* What a plain BRDF makes of the same rows (pipeline_skill.h). */
struct pipeline_skill {
    bool measured; /* false where a row is lit by an environment too */
    struct plain_brdf brdf;
    double fit_rel_rms, heldout_rel_rms; /* NaN without rows of that set */
    double left_out_rel_rms;             /* fitted rows by cross-validation; NaN with too few of them */
};

/* What the photograph of the cloth's texture shows (pipeline_texture.h). */
enum { PIPELINE_TEXTURE_MAX_TAKEN = 48 };
struct pipeline_texture {
    bool found, contradicts; /* contradicts: the job's draft is another one */
    struct weave_guess guess;
    size_t n_taken; /* start values that came from the photograph: keys of "cloth", names of parameters */
    char taken[PIPELINE_TEXTURE_MAX_TAKEN][MODEL_SET_TEXT_BYTES];
};

/* The process that will make report.pdf (report_pdf.h). */
struct pdf_helper {
    pid_t pid;    /* 0: none */
    int order_fd; /* a byte written here starts it */
};

struct pipeline_context {
    const struct worker_folder *folder; /* not owned, as the next three */
    struct worker_status *status;
    struct log *log;
    struct thread_pool *pool;
    struct pdf_helper pdf;
    size_t memory_limit_bytes;   /* of the geometry stages; 0: none */
    size_t most_scratch_bytes;   /* bound on the files of `space`; 0: the free disk is */
    struct scratch_space *space; /* of volumes: JOB/work beyond that limit; NULL without one */
    struct progress progress;    /* of the running stage */

    struct job_document *doc;
    bool resumed;                       /* an earlier attempt has left work of the same inputs */
    uint64_t fingerprint;               /* of the job document's text and this build of the program */
    struct environment *environment;    /* image of the surroundings; NULL: none */
    struct photograph_process process;  /* what is known of the camera */
    struct observation_set observation; /* all */
    struct observation_set fitted;      /* those of the set "fit" */
    /* what the fit sees: those, their contrasts if these have a weight, and what is expected between them */
    struct observation_set row;
    struct expected_rows expected;
    struct observation_set contrast; /* of all observations, in their order; empty when not asked for */
    struct fiber_profile profile;    /* empty for a job with a cloth */
    struct bowl_record bowl;         /* of a profile from photographs of a bowl */
    size_t n_model;
    struct pipeline_model *model; /* in the order of the document */
    struct pipeline_numbers number;
    struct pipeline_radius radius; /* when the job has the radius fitted */
    struct pipeline_skill skill;   /* filled in before the report */
    size_t n_input_warning;        /* warnings of reading the job and of its geometry */
    struct verdict verdict;        /* of the best model; filled in before the report */
    json_t *exports;               /* what result.json says of the files for other programs */
    json_t *surface_pictures;      /* and of pictures of the cloth on surfaces */

    struct reconstruct_option option;
    struct reconstruct_report geometry;
    struct volume volume; /* empty when not in memory: pipeline_need_volume */
    struct direction_volume direction;
    struct fiber_set fiber;
    struct fiber_set traced;      /* the fibers of a scan before their ends are joined across the seams; else empty */
    struct fiber_set uncorrected; /* the fibers before the job's corrections; empty without these */
    struct cloth_report cloth;    /* of a described cloth */
    struct pipeline_texture texture;
    struct scene *scene;
    struct scene *section_scene;      /* the fibers with their flat sections; NULL where all models see `scene` */
    struct volume_scene volume_scene; /* of `direction`; only when a volume model is fitted */
    bool has_volume_scene;
    double stage_fraction;   /* of the running stage, as last reported */
    double fit_path;         /* that the fits are expected to take, with what follows them in their stage */
    double usual_wall_s;     /* of the whole job, by the speeds of a common machine (job_need.h) */
    double certificate_s;    /* processor time of the gradient certificates, on one thread (plan_probe.h) */
    double path_share;       /* time of a path in this cloth over that in a closed one */
    double stage_wall_s[16]; /* by index of the stage table; of this attempt, NaN for a stage that an earlier one did */
};

void pipeline_context_init(struct pipeline_context *c);
void pipeline_context_release(struct pipeline_context *c);

/* Reads job.json and the observations: everything that can be wrong with them is found before the first stage. Here
 * and in pipeline_run err->field is a key of the job document. A folder whose lock is not held (lock_fd is -1) is only
 * looked at: what an earlier run left in it stays. */
status pipeline_read_inputs(struct pipeline_context *c, struct error *err);

/* Whether this job has the stage with this index of the stage table. */
bool pipeline_has_stage(const struct pipeline_context *c, size_t i);
/* Runs all stages that are not done. memory: context of the caller with folder, status, log, pool filled in. */
status pipeline_run(struct pipeline_context *c, struct error *err);

/* ---- the stages (pipeline_geometry.c, pipeline_fit.c, pipeline_report.c): run does the work and stores it under
 * work/<stage>/; load brings back what a finished stage stored ---- */
status stage_volume(struct pipeline_context *c, struct error *err);
status stage_volume_load(struct pipeline_context *c, struct error *err);
status stage_orientation(struct pipeline_context *c, struct error *err);
status stage_orientation_load(struct pipeline_context *c, struct error *err);
status stage_fibers(struct pipeline_context *c, struct error *err);
status stage_fibers_load(struct pipeline_context *c, struct error *err);
status stage_directions(struct pipeline_context *c, struct error *err);
status stage_directions_load(struct pipeline_context *c, struct error *err);
status stage_scene(struct pipeline_context *c, struct error *err);
status stage_fit(struct pipeline_context *c, struct error *err);
status stage_fit_load(struct pipeline_context *c, struct error *err);
status stage_validation(struct pipeline_context *c, struct error *err);
status stage_validation_load(struct pipeline_context *c, struct error *err);
status stage_report(struct pipeline_context *c, struct error *err);
/* of a job with the profile of a fiber, in place of the stages "fit" and "report" (pipeline_profile.c) */
status stage_profile_fit(struct pipeline_context *c, struct error *err);
status stage_profile_report(struct pipeline_context *c, struct error *err);

/* The error of a job that took over a geometry (pipeline_adopt.h) which cannot be read. */
status pipeline_geometry_lost(const struct pipeline_context *c, const char *why, struct error *err);

/* Adds a warning to the job's status, with the key of the option that it is about (base/option_id.h). context: a struct
 * pipeline_context. */
void pipeline_warn(void *context, const char *option, const char *text);
/* Voxels of the job's scan as its files state them; none of them is read. Errors as of volume_source_open_declared. */
status pipeline_scan_size(const struct pipeline_context *c, size_t n[3], struct error *err);
/* Makes sure that the density volume is in memory; reads it from its checkpoint if it was released. */
status pipeline_need_volume(struct pipeline_context *c, struct error *err);
/* Writes the path of a stage's checkpoint, JOB/work/<stage>/<name>, and makes its folder. */
status pipeline_work_path(const struct pipeline_context *c, const char *stage, const char *name,
                          char path[WORKER_PATH_BYTES], struct error *err);
/* Builds the scene for ray tracing from the present fibers, and releases an earlier one. The second function builds
 * it for surface models only. */
status pipeline_make_scene(struct pipeline_context *c, struct error *err);
status pipeline_make_surface_scene(struct pipeline_context *c, struct error *err);
/* The scene of other fibers as a model sees them, with the options of the job; the caller frees it. */
status pipeline_fiber_scene(const struct pipeline_context *c, size_t i_model, const struct fiber_set *f,
                            struct scene **scene, struct error *err);
/* The same as pipeline_work_path, with a number in the name for all models but the first: "estimates.journal",
 * "estimates-1.journal". */
status pipeline_model_path(const struct pipeline_context *c, const char *stage, const char *name, size_t i_model,
                           char path[WORKER_PATH_BYTES], struct error *err);
/* The scene of the fibers as a model sees them: with their flat sections where it states the width that a section
 * shows, else as round tubes. And that of the volume when there is one. */
struct appearance_scene pipeline_scene(const struct pipeline_context *c, const struct pipeline_model *m);
/* Number of unknowns of a model's fit: parameters that are neither fixed nor tied to another one. */
size_t pipeline_n_free(const struct pipeline_model *m);

#endif
