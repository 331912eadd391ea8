/* The inputs of a job, read before its first stage: the document, the rows of the fit, the models with their
 * parameters. Owned by the struct unless a comment says otherwise. */
#ifndef SELVEDGE_OPTIMIZER_JOB_INPUTS_H
#define SELVEDGE_OPTIMIZER_JOB_INPUTS_H

#include "base/catalogue/model_sets.h"
#include "geometry/weave/weave_detect.h"
#include "optimizer/fit/baseline/expected_rows.h"
#include "optimizer/fit/cloth/cloth_search.h"
#include "optimizer/fit/descent/descent.h"

#include "optimizer/job/document/job_sections.h"
#include "optimizer/photographs/camera/photograph_develop.h"
#include "optimizer/photographs/profile/bowl_profile.h"
#include "optimizer/photographs/profile/fiber_profile.h"
#include "optimizer/photographs/rows/observation.h"
#include "optimizer/stages/run/stage_tools.h"
#include "renderer/scattering/appearance.h"
#include "renderer/transport/discrepancy.h"

/* The rows of a job. */
struct measured_rows {
    struct environment *environment;    /* image of the surroundings; NULL: none */
    struct photograph_process process;  /* the camera and its noise */
    struct observation_set observation; /* all */
    struct observation_set fitted;      /* the rows of the set "fit" */
    /* The rows that the fit sees: the fitted ones, their contrasts if these have a weight, and the radiances that a
     * plain BRDF expects between them. */
    struct observation_set row;
    struct expected_rows expected;
    struct observation_set contrast; /* of all observations, in their order; empty when not asked for */
};

/* The profile of a single fiber; empty for a job with a cloth. */
struct profile_rows {
    struct fiber_profile profile;
    struct bowl_record bowl; /* of a profile from photographs of a bowl */
};

/* The result of an earlier job whose parameters are shown: of each row of measured_rows.observation its rendered mean
 * and variance, the smooth factor, and the paths that its fit took. */
struct given_result {
    double (*rendered_rgb)[3], (*rendered_var)[3]; /* NULL: none was given */
    struct discrepancy factor;
    uint64_t n_fit_path; /* of its fit; 0: not known */
};

/* A model of the job and its parameters before the fit. */
struct model_setup {
    struct appearance appearance;
    struct model_sets sets; /* its parameters: one set, or one for each group of fibers */
    struct fit_parameter parameter[FIT_MAX_PARAM];
    const struct job_fit_option *option; /* of the document */
};

/* The numbers of the cloth that are fitted together with the scattering parameters (pipeline_cloth.h). Values are in
 * the units of files. */
struct cloth_numbers {
    size_t n; /* 0: the cloth is taken as it is */
    struct param_info info[CLOTH_MAX_FITTED];
    struct fit_parameter range[CLOTH_MAX_FITTED];
    struct cloth_number_item {
        const char *unit;
        size_t index;                /* of the number in the description of the cloth */
        double prior_mean, prior_sd; /* NaN: no prior */
    } item[CLOTH_MAX_FITTED];
};

/* The weave, as read from a photograph of the cloth's texture (pipeline_texture.h). */
enum { TEXTURE_MAX_TAKEN = 48 };
struct texture_guess {
    bool found, contradicts; /* contradicts: the job's draft is another one */
    struct weave_guess guess;
    size_t n_taken; /* start values that came from the photograph: keys of "cloth", names of parameters */
    char taken[TEXTURE_MAX_TAKEN][MODEL_SET_TEXT_BYTES];
};

struct job_inputs {
    struct job_document *doc;
    struct job_sections section; /* of doc */
    enum job_kind kind;
    bool resumed;         /* an earlier attempt has left work of the same inputs */
    uint64_t fingerprint; /* of the job document's text and this build of the program */
    struct measured_rows rows;
    struct given_result given;
    struct profile_rows fiber;
    size_t n_model;
    struct model_setup *model; /* in the order of the document */
    struct cloth_numbers number;
    struct texture_guess texture;
    json_t *files; /* ledgers of the files that were read (base/files/file_ledger_json.h) */
};

void job_inputs_init(struct job_inputs *in);
void job_inputs_release(struct job_inputs *in);

/* Reads job.json and the observations: everything that can be wrong with them is found before the first stage.
 * err->field is a key of the job document. A folder whose lock is not held (lock_fd is -1) is only read: files that an
 * earlier run left in it stay. */
status job_inputs_read(const struct stage_tools *tools, struct job_inputs *in, struct error *err);

/* Number of unknowns of a model's fit: parameters that are neither fixed nor tied to another one. */
size_t model_setup_n_free(const struct model_setup *m);

#endif
