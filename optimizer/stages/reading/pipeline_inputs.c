/* Reads and checks the inputs of a job before its first stage: the document, the parameters of its models, the
 * observations. */
#include "base/files/durable.h"
#include "base/files/file_ledger_json.h"
#include "base/option_id.h"
#include "optimizer/fit/baseline/row_consistency.h"
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_fit_option.h"
#include "optimizer/job/document/job_profile.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/job/document/job_scan.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/job/job_parse.h"
#include "optimizer/job/options/option_key.h"
#include "optimizer/photographs/camera/photograph_process_load.h"
#include "optimizer/photographs/rows/observation_check.h"
#include "optimizer/photographs/rows/observation_load.h"
#include "optimizer/stages/fit/pipeline_cloth.h"
#include "optimizer/stages/job_inputs.h"
#include "optimizer/stages/reading/given_result.h"
#include "optimizer/stages/reading/pipeline_budget.h"
#include "optimizer/stages/reading/pipeline_profile_prior.h"
#include "optimizer/stages/reading/pipeline_texture.h"
#include "optimizer/stages/reading/texture_start.h"
#include "optimizer/stages/run/worker_folder.h"
#include "optimizer/stages/scene/draft_file.h"
#include "optimizer/stages/scene/fiber_file.h"
#include "optimizer/stages/scene/mesh_file.h"
#include "optimizer/stages/scene/pipeline_adopt.h"
#include "optimizer/stages/scene/pipeline_volume.h"
#include "optimizer/stages/scene/scan_order.h"
#include "renderer/transport/environment.h"

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
    const struct stage_tools *tools;
    size_t n;
};

static void warn_photograph(void *context, const char *option, const char *text)
{
    struct uneven_photographs *uneven = context;
    if (option[0] != '\0' || ++uneven->n <= NAMED_PHOTOGRAPHS)
        warning_send(&uneven->tools->warn, option, "%s", text);
    else
        log_warning(uneven->tools->log, "%s", text);
}

static status load_observations(const struct stage_tools *tools, struct job_inputs *in, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    struct uneven_photographs uneven = {.tools = tools};
    worker_folder_path(tools->folder, JOB_FOLDER_INPUT, NULL, path);
    in->rows.process.files = in->files;
    in->rows.process.warn = &tools->warn;
    status s = photograph_process_load(&in->rows.process, in->doc->setup, in->doc->rows, path, err);
    if (s == STATUS_OK)
        s = observation_set_load(in->section.setup, in->section.rows, in->section.fit, path, &in->rows.process,
                                 &(struct warning_sink){warn_photograph, &uneven}, &in->rows.observation, err);
    if (s != STATUS_OK) return s;
    if (uneven.n > NAMED_PHOTOGRAPHS)
        worker_status_warn(tools->status, "%zu more warnings about photographs are in the job's log",
                           uneven.n - NAMED_PHOTOGRAPHS);
    if (in->section.rows->measurement_file[0] != '\0')
        s = row_consistency_check_angles(&in->rows.observation, OPTION_MEASUREMENT_FILE, err);
    if (s == STATUS_OK) observation_set_check(&in->rows.observation, &tools->warn);
    return s == STATUS_OK ? row_consistency_warn(&in->rows.observation, &tools->warn, err) : s;
}

/* The image of the surroundings, which every observation is taken under. */
static status load_environment(const struct stage_tools *tools, struct job_inputs *in, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    if (in->section.setup->environment_file[0] == '\0') return STATUS_OK;
    worker_folder_path(tools->folder, JOB_FOLDER_INPUT, in->section.setup->environment_file, path);
    status s = environment_read_exr(path, in->section.setup->environment_scale, &in->rows.environment, err);
    if (s != STATUS_OK && err != NULL) snprintf(err->field, sizeof err->field, OPTION_ENVIRONMENT_FILE);
    for (size_t i = 0; i < in->rows.observation.n && s == STATUS_OK; i++)
        in->rows.observation.item[i].configuration.environment = in->rows.environment;
    return s;
}

static status set_parameters(const struct job_model *given, struct model_setup *m, struct error *err)
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

static status set_model(const struct job_fit *fit, const struct job_cloth *cloth, size_t i, struct model_setup *m,
                        struct error *err)
{
    if (!appearance_find(fit->model[i].id, &m->appearance))
        return error_set_field(err, STATUS_INVALID, OPTION_MODEL, "unknown model '%s'", fit->model[i].id);
    status s = model_sets_init(&m->sets, model_catalogue_find(fit->model[i].id), cloth->group, cloth->n_group, err);
    if (s != STATUS_OK && err != NULL) snprintf(err->field, sizeof err->field, OPTION_GROUPS);
    return s == STATUS_OK ? set_parameters(&fit->model[i], m, err) : s;
}

static status set_models(struct job_inputs *in, struct error *err)
{
    in->model = calloc(in->section.fit->n_model, sizeof *in->model);
    if (in->model == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read the job: out of memory");
    in->n_model = in->section.fit->n_model;
    status s = STATUS_OK;
    for (size_t i = 0; i < in->n_model && s == STATUS_OK; i++)
        s = set_model(in->section.fit, in->section.cloth, i, &in->model[i], err);
    return s;
}

static status check_density(const struct job_inputs *in, struct error *err)
{
    bool from_behind = false;
    for (size_t i = 0; i < in->rows.fitted.n; i++)
        if (in->rows.fitted.item[i].configuration.light_theta_rad > M_PI_2) from_behind = true;
    return in->section.fit->fit_density && !from_behind ? job_density_undetermined(in->section.setup->black_sheet, err)
                                                        : STATUS_OK;
}

static void warn_few_rows(const struct stage_tools *tools, struct job_inputs *in)
{
    for (size_t i = 0; i < in->n_model; i++) {
        const size_t n_free = model_setup_n_free(&in->model[i]);
        if (3 * in->rows.fitted.n >= n_free) continue;
        worker_status_warn(
            tools->status,
            "%zu fitted rows give %zu numbers for %zu free parameters of model '%s': some will stay undetermined",
            in->rows.fitted.n, 3 * in->rows.fitted.n, n_free, in->model[i].appearance.id);
    }
}

struct input_sum {
    const struct worker_folder *folder;
    uint32_t sum;
};

/* Adds name, size and time of change of an input file to the checksum. */
static void add_input(void *context, const char *name, const char *role)
{
    struct input_sum *input = context;
    char path[WORKER_PATH_BYTES];
    struct stat st = {0};
    (void)role;
    worker_folder_path(input->folder, JOB_FOLDER_INPUT, name, path);
    if (stat(path, &st) != 0) return; /* the stage that reads the file reports that it is missing */
    int64_t seen[3] = {(int64_t)st.st_size, (int64_t)st.st_mtim.tv_sec, (int64_t)st.st_mtim.tv_nsec};
    input->sum = (uint32_t)crc32_z(input->sum, (const void *)name, strlen(name));
    input->sum = (uint32_t)crc32_z(input->sum, (const void *)seen, sizeof seen);
}

static status match_inputs(const struct stage_tools *tools, struct job_inputs *in, struct error *err)
{
    struct input_sum input = {.folder = tools->folder};
    bool changed;
    char before[WORKER_PATH_BYTES];
    if (tools->folder->lock_fd < 0) return STATUS_OK;
    worker_folder_path(tools->folder, JOB_FOLDER_WORK, WORKER_FILE_FINGERPRINT, before);
    in->resumed = access(before, F_OK) == 0;
    job_sections_visit_files(&in->section, add_input, &input);
    status s = worker_folder_match_inputs(tools->folder, in->fingerprint << 32 | input.sum, &changed, err);
    in->resumed = in->resumed && !changed;
    if (s == STATUS_OK && changed)
        log_info(tools->log, "the inputs, or the program, have changed since the last run: starting anew");
    return s;
}

/* Selects the rows of the fit and makes the rows of contrasts. */
static status select_rows(struct job_inputs *in, struct error *err)
{
    const struct job_fit *fit = in->section.fit;
    status s = observation_set_select(&in->rows.observation, JOB_SET_FIT, &in->rows.fitted, err);
    observation_set_weigh(&in->rows.fitted);
    if (s == STATUS_OK && in->rows.fitted.n == 0)
        s = error_set_field(err, STATUS_INVALID,
                            in->section.rows->measurement_file[0] != '\0' ? OPTION_MEASUREMENT_FILE
                                                                          : OPTION_PHOTOGRAPHS,
                            "all rows of the set 'fit' have the weight 0: give at least one a weight above it");
    if (s == STATUS_OK) s = observation_set_select(&in->rows.fitted, JOB_SET_FIT, &in->rows.row, err);
    if (s != STATUS_OK || !(fit->texture_block_mm > 0.0)) return s;
    s = observation_set_append_contrasts(&in->rows.observation, fit->texture_weight, &in->rows.contrast, err);
    return s == STATUS_OK && fit->texture_weight > 0.0
               ? observation_set_append_contrasts(&in->rows.fitted, fit->texture_weight, &in->rows.row, err)
               : s;
}

/* Adds the radiances that a plain BRDF expects between the rows of the fit. */
static status expect_rows(const struct stage_tools *tools, struct job_inputs *in, struct error *err)
{
    const double strength = in->section.fit->plain_prior;
    status s = expected_rows_append(&in->rows.fitted, strength, &in->rows.expected, &in->rows.row, err);
    if (s != STATUS_OK || !(strength > 0.0)) return s;
    if (in->rows.expected.n == 0)
        worker_status_warn(tools->status,
                           "%s: no plain BRDF can be fitted to these rows (too few directions, no lamp in front, or an "
                           "environment), so the fit goes without one",
                           job_option_key(OPTION_PLAIN_PRIOR));
    else
        log_info(tools->log, "%zu radiances that a plain BRDF expects between the rows weigh as much as %.2g of them",
                 in->rows.expected.n, in->rows.expected.count);
    return STATUS_OK;
}

static status read_document(const struct stage_tools *tools, struct job_inputs *in, struct error *err)
{
    char path[WORKER_PATH_BYTES], *text = NULL;
    size_t n = 0;
    worker_folder_path(tools->folder, JOB_FILE_DOCUMENT, NULL, path);
    status s = file_read_all(path, JOB_MAX_DOCUMENT_BYTES, &text, &n, err);
    if (s != STATUS_OK) return s;
    s = job_document_parse(text, n, &in->doc, err);
    if (s == STATUS_OK) {
        in->section = job_document_sections(in->doc);
        in->kind = job_sections_kind(&in->section);
    }
    in->fingerprint = document_fingerprint(text, n);
    free(text);
    if (s == STATUS_OK && in->section.scan->geometry_job[0] != '\0')
        in->doc->scan->given = true; /* the other job has it */
    return s;
}

/* Reads the values of a job that fits nothing. */
static status take_values(const struct stage_tools *tools, struct job_inputs *in, struct error *err)
{
    status s = cloth_numbers_read(in, err);
    if (s == STATUS_OK && in->number.n > 0)
        s = error_set_field(err, STATUS_INVALID, OPTION_CLOTH,
                            "numbers of the cloth are to be fitted, which needs photographs: give their values");
    if (s == STATUS_OK) s = match_inputs(tools, in, err);
    if (s == STATUS_OK) s = given_result_read(tools, in, err);
    return s == STATUS_OK ? load_environment(tools, in, err) : s;
}

/* Reads the profile of a job without a cloth. */
static status read_profile(const struct stage_tools *tools, struct job_inputs *in, struct error *err)
{
    char folder[WORKER_PATH_BYTES];
    worker_folder_path(tools->folder, JOB_FOLDER_INPUT, NULL, folder);
    status s = match_inputs(tools, in, err);
    if (s != STATUS_OK || !in->section.profile->bowl.given)
        return s == STATUS_OK ? fiber_profile_load(&in->fiber.profile, in->section.profile, folder, err) : s;
    s = bowl_profile_load(&in->fiber.profile, &in->doc->profile->bowl, in->doc->setup, in->doc->rows, folder,
                          &in->fiber.bowl, err);
    if (s == STATUS_OK)
        log_info(tools->log, "%zu photographs of a bowl give %zu cells; the marks are off by %.2g pixels",
                 in->fiber.bowl.n_shot, in->fiber.profile.n, in->fiber.bowl.camera.rms_px);
    return s;
}

static status read_rows(const struct stage_tools *tools, struct job_inputs *in, struct error *err)
{
    if (in->kind == JOB_OF_GEOMETRY) return match_inputs(tools, in, err);
    status s = pipeline_profile_priors(tools, in->doc->cloth, in->doc->fit, err);
    if (s == STATUS_OK) s = set_models(in, err);
    if (s == STATUS_OK && in->kind == JOB_OF_PROFILE) s = read_profile(tools, in, err);
    if (in->kind == JOB_OF_PROFILE) return s;
    if (s == STATUS_OK && in->kind == JOB_OF_PICTURES) return take_values(tools, in, err);
    if (s == STATUS_OK) s = pipeline_read_texture(&(struct texture_input){tools, in->doc->cloth}, &in->texture, err);
    if (s == STATUS_OK) s = cloth_numbers_read(in, err);
    if (s == STATUS_OK) s = match_inputs(tools, in, err);
    if (s == STATUS_OK) s = load_observations(tools, in, err);
    if (s == STATUS_OK) texture_take_colors(tools, in);
    if (s == STATUS_OK) s = load_environment(tools, in, err);
    if (s == STATUS_OK) s = select_rows(in, err);
    if (s == STATUS_OK) s = expect_rows(tools, in, err);
    if (s == STATUS_OK) s = check_density(in, err);
    if (s == STATUS_OK) warn_few_rows(tools, in);
    return s == STATUS_OK ? pipeline_warn_budget(tools, in, err) : s;
}

/* The draft of a described cloth that a file states. */
static status read_draft(const struct stage_tools *tools, const struct job_inputs *in, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    struct file_ledger ledger = {0};
    const struct job_cloth *cloth = in->section.cloth;
    if (cloth->description == NULL || cloth->draft_file[0] == '\0') return STATUS_OK;
    worker_folder_path(tools->folder, JOB_FOLDER_INPUT, cloth->draft_file, path);
    status s = draft_file_take(path, cloth, &ledger, err);
    if (s == STATUS_OK) file_ledger_append(in->files, cloth->draft_file, &ledger);
    return s;
}

/* Statements of the fiber file and of meshes, which later stages read. */
static status examine_files(const struct stage_tools *tools, const struct job_inputs *in, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    const struct job_results *results = in->section.results;
    status s = STATUS_OK;
    worker_folder_path(tools->folder, JOB_FOLDER_INPUT, in->section.cloth->fiber_file, path);
    if (in->section.cloth->fiber_file[0] != '\0') fiber_file_note(path, in->section.cloth, in->files);
    for (size_t i = 0; i < results->n_surface_picture && s == STATUS_OK; i++) {
        const struct job_surface_picture *p = &results->surface_picture[i];
        if (p->on != JOB_ON_MESH) continue;
        worker_folder_path(tools->folder, JOB_FOLDER_INPUT, p->mesh_file, path);
        s = mesh_file_examine(path, p, i, in->files, &tools->warn, err);
    }
    return s;
}

status job_inputs_read(const struct stage_tools *tools, struct job_inputs *in, struct error *err)
{
    in->files = json_array();
    if (in->files == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read the job: out of memory");
    status s = read_document(tools, in, err);
    if (s == STATUS_OK) s = scan_order_check(in->section.scan, in->files, &tools->warn, err);
    if (s == STATUS_OK && in->section.scan->n_file > 0)
        s = scan_examine(tools->folder, in->section.scan, in->files, err);
    if (s == STATUS_OK) s = read_draft(tools, in, err);
    if (s == STATUS_OK) s = examine_files(tools, in, err);
    if (s == STATUS_OK) s = read_rows(tools, in, err);
    if (s == STATUS_OK && tools->folder->lock_fd >= 0)
        s = pipeline_adopt_geometry(tools, in->section.scan->geometry_job, err);
    return job_option_name_field(s, err);
}

void job_inputs_init(struct job_inputs *in)
{
    memset(in, 0, sizeof *in);
    photograph_process_init(&in->rows.process);
    observation_set_init(&in->rows.observation);
    observation_set_init(&in->rows.fitted);
    observation_set_init(&in->rows.row);
    observation_set_init(&in->rows.contrast);
}

void job_inputs_release(struct job_inputs *in)
{
    job_document_free(in->doc);
    photograph_process_release(&in->rows.process);
    observation_set_release(&in->rows.observation);
    observation_set_release(&in->rows.fitted);
    observation_set_release(&in->rows.row);
    observation_set_release(&in->rows.contrast);
    environment_free(in->rows.environment);
    given_result_release(&in->given);
    fiber_profile_release(&in->fiber.profile);
    free(in->model);
    json_decref(in->files);
}

size_t model_setup_n_free(const struct model_setup *m)
{
    size_t n = 0;
    for (size_t p = 0; p < m->sets.info.n_param; p++) n += !m->parameter[p].fixed && m->option->leader[p] == p;
    return n;
}
