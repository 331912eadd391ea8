/* The stage table's computing side: runs what is not done, loads what is. */
#include "base/clock.h"
#include "base/durable.h"
#include "base/option_id.h"
#include "optimizer/fit/photographs/observation_check.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/job/option_key.h"
#include "optimizer/job/stage_table.h"
#include "optimizer/worker/pipeline_context.h"
#include "optimizer/worker/stages/pipeline_budget.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <zlib.h>

enum { NAMED_PHOTOGRAPHS = 3 };

struct stage_code {
    const char *name;
    status (*run)(struct pipeline_context *c, struct error *err);
    status (*load)(struct pipeline_context *c, struct error *err); /* NULL: the stage is cheap, or always runs */
    bool of_volume;                                                /* skipped when the job gives fibers */
};

/* In the order of pipeline_stage_table (a test compares the names). */
static const struct stage_code stage_code[] = {
    {"volume", stage_volume, stage_volume_load, true},
    {"orientation", stage_orientation, stage_orientation_load, true},
    {"fibers", stage_fibers, stage_fibers_load, false},
    {"directions", stage_directions, stage_directions_load, true},
    {"scene", stage_scene, NULL, false},
    {"fit", stage_fit, stage_fit_load, false},
    {"validation", stage_validation, stage_validation_load, false},
    {"report", stage_report, NULL, false},
};

void pipeline_context_init(struct pipeline_context *c)
{
    memset(c, 0, sizeof *c);
    observation_set_init(&c->observation);
    observation_set_init(&c->fitted);
    observation_set_init(&c->row);
    observation_set_init(&c->contrast);
    fiber_set_init(&c->fiber);
    for (size_t i = 0; i < sizeof c->stage_wall_s / sizeof c->stage_wall_s[0]; i++) c->stage_wall_s[i] = NAN;
}

void pipeline_context_release(struct pipeline_context *c)
{
    job_document_free(c->doc);
    observation_set_release(&c->observation);
    observation_set_release(&c->fitted);
    observation_set_release(&c->row);
    observation_set_release(&c->contrast);
    volume_release(&c->volume);
    direction_volume_release(&c->direction);
    fiber_set_release(&c->fiber);
    scratch_space_free(c->space);
    scene_free(c->scene);
    if (c->has_volume_scene) volume_scene_release(&c->volume_scene);
    for (size_t i = 0; i < c->n_model; i++) {
        for (int q = 0; q < 2; q++) {
            free(c->model[i].validation.replica[q]);
            free(c->model[i].validation.contrast[q]);
        }
        free(c->model[i].candidate);
    }
    free(c->model);
}

status pipeline_work_path(const struct pipeline_context *c, const char *stage, const char *name,
                          char path[WORKER_PATH_BYTES], struct error *err)
{
    char relative[256];
    snprintf(relative, sizeof relative, "%s/%s", JOB_FOLDER_WORK, stage);
    worker_folder_path(c->folder, relative, NULL, path);
    status s = durable_make_folder(path, err);
    if (s == STATUS_OK) worker_folder_path(c->folder, relative, name, path);
    return s;
}

status pipeline_model_path(const struct pipeline_context *c, const char *stage, const char *name, size_t i_model,
                           char path[WORKER_PATH_BYTES], struct error *err)
{
    char numbered[128];
    const char *dot = strrchr(name, '.');
    int n = dot != NULL ? (int)(dot - name) : (int)strlen(name);
    if (i_model == 0)
        snprintf(numbered, sizeof numbered, "%s", name);
    else
        snprintf(numbered, sizeof numbered, "%.*s-%zu%s", n, name, i_model, name + n);
    return pipeline_work_path(c, stage, numbered, path, err);
}

struct appearance_scene pipeline_scene(const struct pipeline_context *c)
{
    return (struct appearance_scene){.fibers = c->scene, .volume = c->has_volume_scene ? &c->volume_scene : NULL};
}

const struct objective_value *pipeline_judged_error(const struct pipeline_model *m)
{
    const struct validation *v = &m->validation;
    const bool gains = m->option->gain == JOB_GAIN_PER_PHOTOGRAPH;
    if (isfinite(v->held_out.rel_rms)) return gains ? &v->held_out_with_gains : &v->held_out;
    return gains ? &v->fit_with_gains : &v->fit;
}

size_t pipeline_best_model(const struct pipeline_context *c)
{
    size_t best = 0;
    for (size_t i = 1; i < c->n_model; i++)
        if (pipeline_judged_error(&c->model[i])->rel_square < pipeline_judged_error(&c->model[best])->rel_square)
            best = i;
    return best;
}

void pipeline_warn_option(void *context, const char *option, const char *text)
{
    struct pipeline_context *c = context;
    char key[64], warning[600];
    job_option_resolve(option, key, sizeof key);
    snprintf(warning, sizeof warning, "%s%s%s", key, key[0] != '\0' ? ": " : "", text);
    worker_status_warn(c->status, warning);
}

/* ---- inputs ---- */

static void warn_observation(void *context, const char *text)
{
    struct pipeline_context *c = context;
    worker_status_warn(c->status, text);
}

/* A series of photographs is often uneven alike: name a few of them and count the rest. */
struct uneven_photographs {
    struct pipeline_context *pipeline;
    size_t n;
};

static void warn_photograph(void *context, const char *text)
{
    struct uneven_photographs *uneven = context;
    if (++uneven->n <= NAMED_PHOTOGRAPHS)
        worker_status_warn(uneven->pipeline->status, text);
    else
        log_warning(uneven->pipeline->log, "%s", text);
}

static status load_observations(struct pipeline_context *c, struct error *err)
{
    char path[WORKER_PATH_BYTES], warning[100];
    struct uneven_photographs uneven = {.pipeline = c};
    worker_folder_path(c->folder, JOB_FOLDER_INPUT, NULL, path);
    status s = observation_set_load(c->doc, path, warn_photograph, &uneven, &c->observation, err);
    if (s != STATUS_OK) return s;
    if (uneven.n > NAMED_PHOTOGRAPHS) {
        snprintf(warning, sizeof warning, "%zu more photographs are not uniform: the job's log names them",
                 uneven.n - NAMED_PHOTOGRAPHS);
        worker_status_warn(c->status, warning);
    }
    observation_set_check(&c->observation, warn_observation, c);
    return STATUS_OK;
}

static status set_parameters(const struct job_model *given, struct pipeline_model *m, struct error *err)
{
    struct job_fit_parameter k[JOB_MAX_PARAM];
    status s = job_fit_resolve(m->appearance.param, m->appearance.n_param, given, k, err);
    if (s != STATUS_OK) return s;
    m->option = &given->option;
    for (size_t p = 0; p < m->appearance.n_param; p++) {
        const struct param_info *info = &m->appearance.param[p];
        /* degrees to radians may step over a bound by one rounding */
        double lower = fmin(fmax(param_from_file_unit(info, k[p].lower), info->lower), info->upper);
        double upper = fmin(fmax(param_from_file_unit(info, k[p].upper), lower), info->upper);
        m->parameter[p] = (struct fit_parameter){
            .lower = lower, .upper = upper, .start = param_from_file_unit(info, k[p].start), .fixed = k[p].fixed};
        m->parameter[p].start = fmin(fmax(m->parameter[p].start, lower), upper);
    }
    return STATUS_OK;
}

static status set_models(struct pipeline_context *c, struct error *err)
{
    c->model = calloc(c->doc->n_model, sizeof *c->model);
    if (c->model == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read the job: out of memory");
    c->n_model = c->doc->n_model;
    for (size_t i = 0; i < c->n_model; i++) {
        if (!appearance_find(c->doc->model[i].id, &c->model[i].appearance))
            return error_set_field(err, STATUS_INVALID, OPTION_MODEL, "unknown model '%s'", c->doc->model[i].id);
        status s = set_parameters(&c->doc->model[i], &c->model[i], err);
        if (s != STATUS_OK) return s;
    }
    return STATUS_OK;
}

static status check_density(const struct pipeline_context *c, struct error *err)
{
    bool from_behind = false;
    for (size_t i = 0; i < c->fitted.n; i++)
        if (c->fitted.item[i].configuration.light_theta_rad > M_PI_2) from_behind = true;
    return c->doc->fit_density && !from_behind ? job_density_undetermined(c->doc->black_sheet, err) : STATUS_OK;
}

size_t pipeline_n_free(const struct pipeline_model *m)
{
    size_t n = 0;
    for (size_t p = 0; p < m->appearance.n_param; p++) n += !m->parameter[p].fixed && m->option->leader[p] == p;
    return n;
}

static void warn_few_rows(struct pipeline_context *c)
{
    for (size_t i = 0; i < c->n_model; i++) {
        const size_t n_free = pipeline_n_free(&c->model[i]);
        char warning[300];
        if (3 * c->fitted.n >= n_free) continue;
        snprintf(warning, sizeof warning,
                 "%zu fitted rows give %zu numbers for %zu free parameters of model '%s': some will stay undetermined",
                 c->fitted.n, 3 * c->fitted.n, n_free, c->model[i].appearance.id);
        worker_status_warn(c->status, warning);
    }
}

struct input_sum {
    const struct pipeline_context *pipeline;
    uint32_t sum;
};

/* Name, size and time of change of an input file. */
static void add_input(void *context, const char *name, const char *role)
{
    struct input_sum *input = context;
    char path[WORKER_PATH_BYTES];
    struct stat st = {0};
    (void)role;
    worker_folder_path(input->pipeline->folder, JOB_FOLDER_INPUT, name, path);
    if (stat(path, &st) != 0) return; /* absence is noticed by the stage that reads it */
    int64_t seen[3] = {(int64_t)st.st_size, (int64_t)st.st_mtim.tv_sec, (int64_t)st.st_mtim.tv_nsec};
    input->sum = (uint32_t)crc32_z(input->sum, (const void *)name, strlen(name));
    input->sum = (uint32_t)crc32_z(input->sum, (const void *)seen, sizeof seen);
}

static status claim_inputs(struct pipeline_context *c, struct error *err)
{
    struct input_sum input = {.pipeline = c};
    bool changed;
    job_document_visit_files(c->doc, add_input, &input);
    status s = worker_folder_claim_inputs(c->folder, c->fingerprint << 32 | input.sum, &changed, err);
    if (s == STATUS_OK && changed)
        log_info(c->log, "the inputs, or the program, have changed since the last run: starting anew");
    return s;
}

/* What the fit sees, and the contrasts. */
static status select_rows(struct pipeline_context *c, struct error *err)
{
    const struct job_document *doc = c->doc;
    status s = observation_set_select(&c->observation, JOB_SET_FIT, &c->fitted, err);
    observation_set_weigh(&c->fitted);
    if (s == STATUS_OK && c->fitted.n == 0)
        s = error_set_field(err, STATUS_INVALID,
                            doc->measurement_file[0] != '\0' ? OPTION_MEASUREMENT_FILE : OPTION_PHOTOGRAPHS,
                            "all rows of the set 'fit' have the weight 0: give at least one a weight above it");
    if (s == STATUS_OK) s = observation_set_select(&c->fitted, JOB_SET_FIT, &c->row, err);
    if (s != STATUS_OK || !(doc->texture_block_mm > 0.0)) return s;
    s = observation_set_append_contrasts(&c->observation, doc->texture_weight, &c->contrast, err);
    return s == STATUS_OK && doc->texture_weight > 0.0
               ? observation_set_append_contrasts(&c->fitted, doc->texture_weight, &c->row, err)
               : s;
}

enum { PROGRAM_MAX_BYTES = 256 << 20 };

/* Of the running program: another build may trace other numbers, which must not be mixed with those of the run before. 0
 * where the system does not show it. */
static uint32_t program_sum(void)
{
    char *text = NULL;
    size_t n = 0;
    if (file_read_all("/proc/self/exe", PROGRAM_MAX_BYTES, &text, &n, NULL) != STATUS_OK) return 0;
    uint32_t sum = (uint32_t)crc32_z(0, (const void *)text, n);
    free(text);
    return sum;
}

static status read_inputs(struct pipeline_context *c, struct error *err)
{
    char path[WORKER_PATH_BYTES], *text = NULL;
    size_t n = 0;
    worker_folder_path(c->folder, JOB_FILE_DOCUMENT, NULL, path);
    status s = file_read_all(path, JOB_MAX_DOCUMENT_BYTES, &text, &n, err);
    if (s != STATUS_OK) return s;
    s = job_document_parse(text, n, &c->doc, err);
    c->fingerprint = crc32_z(program_sum(), (const void *)text, n);
    free(text);
    if (s == STATUS_OK) s = set_models(c, err);
    if (s == STATUS_OK) s = claim_inputs(c, err);
    if (s == STATUS_OK) s = load_observations(c, err);
    if (s == STATUS_OK) s = select_rows(c, err);
    if (s == STATUS_OK) s = check_density(c, err);
    if (s == STATUS_OK) warn_few_rows(c);
    return s == STATUS_OK ? pipeline_warn_budget(c, err) : s;
}

status pipeline_read_inputs(struct pipeline_context *c, struct error *err)
{
    return job_option_name_field(read_inputs(c, err), err);
}

/* ---- running ---- */

static void report_fraction(void *context, double fraction)
{
    struct pipeline_context *c = context;
    worker_status_fraction(c->status, fraction);
}

/* A stage that runs outdates what later ones have stored, also for an attempt after this one. */
static status forget_from(struct pipeline_context *c, size_t i, struct error *err)
{
    status s = STATUS_OK;
    for (; i < sizeof stage_code / sizeof stage_code[0] && s == STATUS_OK; i++)
        s = worker_folder_unmark_stage(c->folder, stage_code[i].name, err);
    return s;
}

/* A finished stage is loaded; if its checkpoint cannot be read it runs again, and so do all later ones. */
static status do_stage(struct pipeline_context *c, size_t i, bool *earlier_ran, struct error *err)
{
    const struct stage_code *code = &stage_code[i];
    double start_s = clock_monotonic_s();
    if (code->load != NULL && !*earlier_ran && worker_folder_stage_done(c->folder, code->name)) {
        struct error why = {0};
        if (code->load(c, &why) == STATUS_OK) {
            log_info(c->log, "stage %s: done by an earlier attempt", code->name);
            worker_status_fraction(c->status, 1.0);
            worker_status_restart_eta(c->status);
            return STATUS_OK;
        }
        log_warning(c->log, "stage %s runs again: %s", code->name, why.text);
    }
    status s = code->load != NULL && !*earlier_ran ? forget_from(c, i, err) : STATUS_OK;
    if (code->load != NULL) *earlier_ran = true;
    log_info(c->log, "stage %s", code->name);
    if (s == STATUS_OK) s = code->run(c, err);
    if (s != STATUS_OK) return job_option_name_field(s, err);
    c->stage_wall_s[i] = clock_monotonic_s() - start_s;
    log_info(c->log, "stage %s: %.1f s", code->name, c->stage_wall_s[i]);
    return worker_folder_mark_stage(c->folder, code->name, err);
}

status pipeline_run(struct pipeline_context *c, struct error *err)
{
    size_t n_stage;
    const struct pipeline_stage_info *info = pipeline_stage_table(&n_stage);
    double total = 0.0, done = 0.0;
    bool earlier_ran = false;
    char work[WORKER_PATH_BYTES];
    worker_folder_path(c->folder, JOB_FOLDER_WORK, NULL, work);
    if (c->memory_limit_bytes > 0 && c->space == NULL) {
        status s = scratch_space_new(work, c->memory_limit_bytes, &c->space, err);
        if (s != STATUS_OK) return s;
    }
    c->progress = (struct progress){.report = report_fraction, .context = c, .cancel = worker_status_cancel(c->status)};
    for (size_t i = 0; i < n_stage; i++)
        if (c->doc->has_volume || !stage_code[i].of_volume) total += info[i].weight;
    for (size_t i = 0; i < n_stage; i++) {
        if (!c->doc->has_volume && stage_code[i].of_volume) continue;
        worker_status_stage(c->status, info[i].name, info[i].title, i, n_stage, done / total, info[i].weight / total);
        status s = do_stage(c, i, &earlier_ran, err);
        if (s == STATUS_OK && progress_cancelled(&c->progress)) s = error_set(err, STATUS_CANCELLED, "cancelled");
        if (s != STATUS_OK) return s;
        done += info[i].weight;
    }
    return STATUS_OK;
}
