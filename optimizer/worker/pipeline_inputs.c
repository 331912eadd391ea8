/* Reads and checks the inputs of a job before its first stage: the document, the parameters of its models, the
 * observations. */
#include "base/files/durable.h"
#include "base/option_id.h"
#include "optimizer/fit/baseline/row_slips.h"
#include "optimizer/fit/photographs/observation_check.h"
#include "optimizer/fit/photographs/observation_load.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/job/job_parse.h"
#include "optimizer/job/options/option_key.h"
#include "optimizer/worker/document_fingerprint.h"
#include "optimizer/worker/pipeline_context.h"
#include "optimizer/worker/stages/fit/pipeline_budget.h"
#include "optimizer/worker/stages/fit/pipeline_cloth.h"
#include "optimizer/worker/stages/fit/pipeline_profile_prior.h"
#include "optimizer/worker/stages/scene/pipeline_adopt.h"
#include "optimizer/worker/stages/scene/pipeline_texture.h"
#include "optimizer/worker/stages/scene/texture_start.h"
#include "renderer/transport/light/environment.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

enum { NAMED_PHOTOGRAPHS = 3 };

/* A series of photographs often has the same fault: the first few are named in the job's status, all in its log. */
struct uneven_photographs {
    struct pipeline_context *pipeline;
    size_t n;
};

static void warn_photograph(void *context, const char *option, const char *text)
{
    struct uneven_photographs *uneven = context;
    if (option[0] != '\0' || ++uneven->n <= NAMED_PHOTOGRAPHS)
        pipeline_warn(uneven->pipeline, option, text);
    else
        log_warning(uneven->pipeline->log, "%s", text);
}

static status load_observations(struct pipeline_context *c, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    struct uneven_photographs uneven = {.pipeline = c};
    worker_folder_path(c->folder, JOB_FOLDER_INPUT, NULL, path);
    status s = photograph_process_load(&c->process, c->doc, path, err);
    if (s == STATUS_OK)
        s = observation_set_load(c->doc, path, &c->process, &(struct warning_sink){warn_photograph, &uneven},
                                 &c->observation, err);
    if (s != STATUS_OK) return s;
    if (uneven.n > NAMED_PHOTOGRAPHS)
        worker_status_warn(c->status, "%zu more warnings about photographs are in the job's log",
                           uneven.n - NAMED_PHOTOGRAPHS);
    const struct warning_sink warn = {pipeline_warn, c};
    if (c->doc->rows.measurement_file[0] != '\0')
        s = row_slips_check_angles(&c->observation, OPTION_MEASUREMENT_FILE, err);
    if (s == STATUS_OK) observation_set_check(&c->observation, &warn);
    return s == STATUS_OK ? row_slips_warn(&c->observation, &warn, err) : s;
}

/* The image of the surroundings, which every observation is taken under. */
static status load_environment(struct pipeline_context *c, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    if (c->doc->setup.environment_file[0] == '\0') return STATUS_OK;
    worker_folder_path(c->folder, JOB_FOLDER_INPUT, c->doc->setup.environment_file, path);
    status s = environment_read_exr(path, c->doc->setup.environment_scale, &c->environment, err);
    if (s != STATUS_OK && err != NULL) snprintf(err->field, sizeof err->field, OPTION_ENVIRONMENT_FILE);
    for (size_t i = 0; i < c->observation.n && s == STATUS_OK; i++)
        c->observation.item[i].configuration.environment = c->environment;
    return s;
}

static status set_parameters(const struct job_model *given, struct pipeline_model *m, struct error *err)
{
    struct job_fit_parameter k[JOB_MAX_PARAM];
    status s = job_fit_resolve(m->sets.info.param, m->sets.info.n_param, given, k, err);
    if (s != STATUS_OK) return s;
    m->option = &given->option;
    for (size_t p = 0; p < m->sets.info.n_param; p++) {
        const struct param_info *info = &m->sets.info.param[p];
        /* degrees to radians may step over a bound by one rounding */
        double lower = fmin(fmax(param_from_file_unit(info, k[p].lower), info->lower), info->upper);
        double upper = fmin(fmax(param_from_file_unit(info, k[p].upper), lower), info->upper);
        m->parameter[p] = (struct fit_parameter){
            .lower = lower, .upper = upper, .start = param_from_file_unit(info, k[p].start), .fixed = k[p].fixed};
        m->parameter[p].start = fmin(fmax(m->parameter[p].start, lower), upper);
    }
    return STATUS_OK;
}

static status set_model(const struct job_document *doc, size_t i, struct pipeline_model *m, struct error *err)
{
    if (!appearance_find(doc->fit.model[i].id, &m->appearance))
        return error_set_field(err, STATUS_INVALID, OPTION_MODEL, "unknown model '%s'", doc->fit.model[i].id);
    status s = model_sets_init(&m->sets, model_catalogue_find(doc->fit.model[i].id), doc->cloth.group,
                               doc->cloth.n_group, err);
    if (s != STATUS_OK && err != NULL) snprintf(err->field, sizeof err->field, OPTION_GROUPS);
    return s == STATUS_OK ? set_parameters(&doc->fit.model[i], m, err) : s;
}

static status set_models(struct pipeline_context *c, struct error *err)
{
    c->model = calloc(c->doc->fit.n_model, sizeof *c->model);
    if (c->model == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read the job: out of memory");
    c->n_model = c->doc->fit.n_model;
    status s = STATUS_OK;
    for (size_t i = 0; i < c->n_model && s == STATUS_OK; i++) s = set_model(c->doc, i, &c->model[i], err);
    return s;
}

static status check_density(const struct pipeline_context *c, struct error *err)
{
    bool from_behind = false;
    for (size_t i = 0; i < c->fitted.n; i++)
        if (c->fitted.item[i].configuration.light_theta_rad > M_PI_2) from_behind = true;
    return c->doc->fit.fit_density && !from_behind ? job_density_undetermined(c->doc->setup.black_sheet, err)
                                                   : STATUS_OK;
}

static void warn_few_rows(struct pipeline_context *c)
{
    for (size_t i = 0; i < c->n_model; i++) {
        const size_t n_free = pipeline_n_free(&c->model[i]);
        if (3 * c->fitted.n >= n_free) continue;
        worker_status_warn(
            c->status,
            "%zu fitted rows give %zu numbers for %zu free parameters of model '%s': some will stay undetermined",
            c->fitted.n, 3 * c->fitted.n, n_free, c->model[i].appearance.id);
    }
}

struct input_sum {
    const struct pipeline_context *pipeline;
    uint32_t sum;
};

/* Adds name, size and time of change of an input file to the checksum. */
static void add_input(void *context, const char *name, const char *role)
{
    struct input_sum *input = context;
    char path[WORKER_PATH_BYTES];
    struct stat st = {0};
    (void)role;
    worker_folder_path(input->pipeline->folder, JOB_FOLDER_INPUT, name, path);
    if (stat(path, &st) != 0) return; /* the stage that reads the file reports that it is missing */
    int64_t seen[3] = {(int64_t)st.st_size, (int64_t)st.st_mtim.tv_sec, (int64_t)st.st_mtim.tv_nsec};
    input->sum = (uint32_t)crc32_z(input->sum, (const void *)name, strlen(name));
    input->sum = (uint32_t)crc32_z(input->sum, (const void *)seen, sizeof seen);
}

static status claim_inputs(struct pipeline_context *c, struct error *err)
{
    struct input_sum input = {.pipeline = c};
    bool changed;
    char before[WORKER_PATH_BYTES];
    if (c->folder->lock_fd < 0) return STATUS_OK;
    worker_folder_path(c->folder, JOB_FOLDER_WORK, WORKER_FILE_FINGERPRINT, before);
    c->resumed = access(before, F_OK) == 0;
    job_document_visit_files(c->doc, add_input, &input);
    status s = worker_folder_claim_inputs(c->folder, c->fingerprint << 32 | input.sum, &changed, err);
    c->resumed = c->resumed && !changed;
    if (s == STATUS_OK && changed)
        log_info(c->log, "the inputs, or the program, have changed since the last run: starting anew");
    return s;
}

/* Selects the rows of the fit and makes the rows of contrasts. */
static status select_rows(struct pipeline_context *c, struct error *err)
{
    const struct job_document *doc = c->doc;
    status s = observation_set_select(&c->observation, JOB_SET_FIT, &c->fitted, err);
    observation_set_weigh(&c->fitted);
    if (s == STATUS_OK && c->fitted.n == 0)
        s = error_set_field(err, STATUS_INVALID,
                            doc->rows.measurement_file[0] != '\0' ? OPTION_MEASUREMENT_FILE : OPTION_PHOTOGRAPHS,
                            "all rows of the set 'fit' have the weight 0: give at least one a weight above it");
    if (s == STATUS_OK) s = observation_set_select(&c->fitted, JOB_SET_FIT, &c->row, err);
    if (s != STATUS_OK || !(doc->fit.texture_block_mm > 0.0)) return s;
    s = observation_set_append_contrasts(&c->observation, doc->fit.texture_weight, &c->contrast, err);
    return s == STATUS_OK && doc->fit.texture_weight > 0.0
               ? observation_set_append_contrasts(&c->fitted, doc->fit.texture_weight, &c->row, err)
               : s;
}

/* Adds what a plain BRDF expects between the rows of the fit. */
static status expect_rows(struct pipeline_context *c, struct error *err)
{
    const double strength = c->doc->fit.plain_prior;
    status s = expected_rows_append(&c->fitted, strength, &c->expected, &c->row, err);
    if (s != STATUS_OK || !(strength > 0.0)) return s;
    if (c->expected.n == 0)
        worker_status_warn(c->status,
                           "%s: no plain BRDF can be fitted to these rows (too few directions, no lamp in front, or an "
                           "environment), so the fit goes without one",
                           job_option_key(OPTION_PLAIN_PRIOR));
    else
        log_info(c->log, "%zu radiances that a plain BRDF expects between the rows weigh as much as %.2g of them",
                 c->expected.n, c->expected.count);
    return STATUS_OK;
}

static status read_document(struct pipeline_context *c, struct error *err)
{
    char path[WORKER_PATH_BYTES], *text = NULL;
    size_t n = 0;
    worker_folder_path(c->folder, JOB_FILE_DOCUMENT, NULL, path);
    status s = file_read_all(path, JOB_MAX_DOCUMENT_BYTES, &text, &n, err);
    if (s != STATUS_OK) return s;
    s = job_document_parse(text, n, &c->doc, err);
    c->fingerprint = document_fingerprint(text, n);
    free(text);
    if (s == STATUS_OK && c->doc->scan.geometry_job[0] != '\0') c->doc->scan.given = true; /* the other job has it */
    return s;
}

/* Of a job that fits nothing: the parameters are those that the document holds fixed. */
static status take_values(struct pipeline_context *c, struct error *err)
{
    struct pipeline_model *m = c->model;
    status s = pipeline_cloth_inputs(c, err);
    if (s == STATUS_OK && c->number.n > 0)
        s = error_set_field(err, STATUS_INVALID, OPTION_CLOTH,
                            "numbers of the cloth are to be fitted, which needs photographs: give their values");
    for (size_t p = 0; p < m->sets.info.n_param; p++) {
        m->fit.param[p] = m->parameter[p].start;
        m->fit.uncertainty.se_param[p] = NAN;
        m->fit.uncertainty.determined[p] = true;
    }
    if (s == STATUS_OK) s = claim_inputs(c, err);
    return s == STATUS_OK ? load_environment(c, err) : s;
}

/* Of a job without a cloth. */
static status read_profile(struct pipeline_context *c, struct error *err)
{
    char folder[WORKER_PATH_BYTES];
    worker_folder_path(c->folder, JOB_FOLDER_INPUT, NULL, folder);
    status s = claim_inputs(c, err);
    if (s != STATUS_OK || !c->doc->profile.bowl.given)
        return s == STATUS_OK ? fiber_profile_load(&c->profile, c->doc, folder, err) : s;
    s = bowl_profile_load(&c->profile, c->doc, folder, &c->bowl, err);
    if (s == STATUS_OK)
        log_info(c->log, "%zu photographs of a bowl give %zu cells; the marks are off by %.2g pixels", c->bowl.n_shot,
                 c->profile.n, c->bowl.camera.rms_px);
    return s;
}

static status read_rows(struct pipeline_context *c, struct error *err)
{
    if (job_document_kind(c->doc) == JOB_OF_GEOMETRY) return claim_inputs(c, err);
    status s = pipeline_profile_priors(c, err);
    if (s == STATUS_OK) s = set_models(c, err);
    if (s == STATUS_OK && job_document_kind(c->doc) == JOB_OF_PROFILE) s = read_profile(c, err);
    if (job_document_kind(c->doc) == JOB_OF_PROFILE) return s;
    if (s == STATUS_OK && job_document_kind(c->doc) == JOB_OF_PICTURES) return take_values(c, err);
    if (s == STATUS_OK) s = pipeline_read_texture(c, err);
    if (s == STATUS_OK) s = pipeline_cloth_inputs(c, err);
    if (s == STATUS_OK) s = claim_inputs(c, err);
    if (s == STATUS_OK) s = load_observations(c, err);
    if (s == STATUS_OK) texture_take_colors(c);
    if (s == STATUS_OK) s = load_environment(c, err);
    if (s == STATUS_OK) s = select_rows(c, err);
    if (s == STATUS_OK) s = expect_rows(c, err);
    if (s == STATUS_OK) s = check_density(c, err);
    if (s == STATUS_OK) warn_few_rows(c);
    return s == STATUS_OK ? pipeline_warn_budget(c, err) : s;
}

status pipeline_read_inputs(struct pipeline_context *c, struct error *err)
{
    status s = read_document(c, err);
    if (s == STATUS_OK) s = read_rows(c, err);
    if (s == STATUS_OK && c->folder->lock_fd >= 0) s = pipeline_adopt_geometry(c, err);
    return job_option_name_field(s, err);
}
