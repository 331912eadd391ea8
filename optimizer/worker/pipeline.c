/* Runs the stages of a job in the order of the stage table, and loads those that an earlier attempt has finished. */
#include "base/clock.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/job/options/option_key.h"
#include "optimizer/job/stage_table.h"
#include "optimizer/worker/pipeline_context.h"
#include "optimizer/worker/progress/pipeline_plan.h"
#include "optimizer/worker/ranks/worker_team.h"

#include <math.h>

struct stage_code {
    const char *name;
    status (*run)(struct pipeline_context *c, struct error *err);
    status (*load)(struct pipeline_context *c, struct error *err); /* NULL: the stage is cheap, or always runs */
    bool of_volume;                                                /* skipped when the job gives fibers */
    bool of_scene;                                                 /* skipped when the job ends with the geometry */
    bool of_fit;                                                   /* skipped when the job has no measurements */
    /* what the stage does for the profile of a fiber, always anew; NULL: such a job skips it */
    status (*run_profile)(struct pipeline_context *c, struct error *err);
};

/* In the order of pipeline_stage_table (a test compares the names). */
static const struct stage_code stage_code[] = {
    {"volume", stage_volume, stage_volume_load, .of_volume = true},
    {"orientation", stage_orientation, stage_orientation_load, .of_volume = true},
    {"fibers", stage_fibers, stage_fibers_load},
    {"directions", stage_directions, stage_directions_load, .of_volume = true},
    {"scene", stage_scene, NULL, .of_scene = true},
    {"fit", stage_fit, stage_fit_load, .of_scene = true, .of_fit = true, .run_profile = stage_profile_fit},
    {"validation", stage_validation, stage_validation_load, .of_scene = true, .of_fit = true},
    {"report", stage_report, NULL, .run_profile = stage_profile_report},
};

static void report_fraction(void *context, double fraction)
{
    struct pipeline_context *c = context;
    c->stage_fraction = fraction;
    worker_status_fraction(c->status, fraction);
}

/* Removes the marks of stage i and of all later ones: when a stage runs, what later stages have stored is out of
 * date, also for a later attempt. */
static status unmark_from(struct pipeline_context *c, size_t i, struct error *err)
{
    status s = STATUS_OK;
    for (; i < sizeof stage_code / sizeof stage_code[0] && s == STATUS_OK; i++)
        s = worker_folder_unmark_stage(c->folder, stage_code[i].name, err);
    return s;
}

/* A finished stage is loaded; if its checkpoint cannot be read it runs again, and so do all later ones. */
static status do_stage(struct pipeline_context *c, size_t i, bool *earlier_ran, bool *loaded, struct error *err)
{
    struct stage_code own = stage_code[i];
    const struct stage_code *code = &own;
    if (job_document_kind(c->doc) == JOB_OF_PROFILE) {
        own.run = own.run_profile;
        own.load = NULL;
    }
    double start_s = clock_monotonic_s();
    if (code->load != NULL && !*earlier_ran && worker_folder_stage_done(c->folder, code->name)) {
        struct error why = {0};
        if (code->load(c, &why) == STATUS_OK) {
            log_info(c->log, "stage %s: done by an earlier attempt", code->name);
            *loaded = true;
            return STATUS_OK;
        }
        if (c->doc->scan.geometry_job[0] != '\0' && !code->of_scene)
            return job_option_name_field(pipeline_geometry_lost(c, why.text, err), err);
        log_warning(c->log, "stage %s runs again: %s", code->name, why.text);
    }
    status s = code->load != NULL && !*earlier_ran ? unmark_from(c, i, err) : STATUS_OK;
    if (code->load != NULL) *earlier_ran = true;
    log_info(c->log, "stage %s", code->name);
    struct rank_traffic before = {.n_share = 0};
    worker_team_begin_stage(c->pool, &before);
    if (s == STATUS_OK) s = code->run(c, err);
    if (s != STATUS_OK) return job_option_name_field(s, err);
    c->stage_wall_s[i] = clock_monotonic_s() - start_s;
    log_info(c->log, "stage %s: %.1f s", code->name, c->stage_wall_s[i]);
    worker_team_end_stage(c->pool, &before, code->name, c->log);
    return worker_folder_mark_stage(c->folder, code->name, err);
}

bool pipeline_has_stage(const struct pipeline_context *c, size_t i)
{
    if (job_document_kind(c->doc) == JOB_OF_PROFILE) return stage_code[i].run_profile != NULL;
    return (!stage_code[i].of_volume || c->doc->scan.given) &&
           (!stage_code[i].of_scene || job_document_kind(c->doc) != JOB_OF_GEOMETRY) &&
           (!stage_code[i].of_fit || job_document_kind(c->doc) == JOB_OF_FIT);
}

status pipeline_run(struct pipeline_context *c, struct error *err)
{
    size_t n_stage;
    const struct pipeline_stage_info *info = pipeline_stage_table(&n_stage);
    bool earlier_ran = false;
    char work[WORKER_PATH_BYTES];
    worker_folder_path(c->folder, JOB_FOLDER_WORK, NULL, work);
    if (c->memory_limit_bytes > 0 && c->space == NULL) {
        status s = scratch_space_new(work, c->memory_limit_bytes, &c->space, err);
        if (s != STATUS_OK) return s;
        scratch_space_bound(c->space, c->most_scratch_bytes);
    }
    c->progress = (struct progress){.report = report_fraction, .context = c, .cancel = worker_status_cancel(c->status)};
    for (size_t i = 0; i < n_stage; i++) {
        if (!pipeline_has_stage(c, i)) continue;
        if (stage_code[i].run == stage_fit) c->n_input_warning = worker_status_n_warning(c->status);
        bool loaded = false;
        for (size_t later = i; later < n_stage; later++)
            if (pipeline_has_stage(c, later)) pipeline_plan_stage(c, info[later].name, later);
        c->stage_fraction = 0.0;
        worker_status_stage(c->status, info[i].name, info[i].title, i, n_stage);
        status s = do_stage(c, i, &earlier_ran, &loaded, err);
        worker_status_stage_end(c->status, loaded);
        if (s == STATUS_OK && progress_cancelled(&c->progress)) s = error_set(err, STATUS_CANCELLED, "cancelled");
        if (s != STATUS_OK) return s;
    }
    return STATUS_OK;
}
