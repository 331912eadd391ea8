#include "optimizer/worker/pipeline.h"
#include "base/clock.h"
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_scan.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/job/job_outline.h"
#include "optimizer/job/options/option_key.h"
#include "optimizer/job/stage_table.h"
#include "optimizer/report/result/first_results.h"
#include "optimizer/report/surface/surface_cloth.h"
#include "optimizer/stages/scene/pipeline_adopt.h"
#include "optimizer/worker/worker_team.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_STAGE = 16 };

/* Outputs of the stages, one bit each. */
enum { VOLUME = 1, ORIENTATION = 2, FIBERS = 4, DIRECTIONS = 8, CLOTH = 16, FIT = 32, VALIDATION = 64 };

struct outputs {
    struct volume_output volume;
    struct orientation_output orientation;
    struct fibers_output fibers;
    struct directions_output directions;
    struct made_cloth cloth;
    struct fit_output fit;
    struct validation_output validation;
    struct report_output report;
};

/* The outputs that a stage takes; the others are NULL. */
struct taken {
    const struct volume_output *volume;
    const struct orientation_output *orientation;
    const struct fibers_output *fibers;
    const struct directions_output *directions;
    struct made_cloth *cloth; /* which later stages make anew with other numbers */
    const struct fit_output *fit;
    const struct validation_output *validation;
};

struct pipeline {
    struct stage_tools *tools;
    const struct job_inputs *in;
    const struct pipeline_option *option;
    struct job_plan *plan;
    struct job_outline files;
    struct cloth_job job;
    struct outputs out;
    double stage_wall_s[MAX_STAGE]; /* of this attempt, NaN for a stage that an earlier one did */
    size_t n_input_warning;
};

/* ---- the stages with their inputs; load: the output of a finished stage is read back ---- */

static status do_volume(struct pipeline *p, const struct taken *t, bool load, struct error *err)
{
    const struct volume_input in = {p->tools, p->in->section.scan};
    (void)t;
    status s = (load ? stage_volume_load : stage_volume)(&in, &p->out.volume, err);
    p->plan->geometry = p->out.volume.geometry;
    return s;
}

static status do_orientation(struct pipeline *p, const struct taken *t, bool load, struct error *err)
{
    const struct orientation_input in = {p->tools, t->volume};
    status s = (load ? stage_orientation_load : stage_orientation)(&in, &p->out.orientation, err);
    p->plan->geometry = p->out.orientation.geometry;
    return s;
}

static status do_fibers(struct pipeline *p, const struct taken *t, bool load, struct error *err)
{
    const struct fibers_input in = {p->tools, p->in->section.scan, p->in->section.cloth, t->volume, t->orientation};
    status s = (load ? stage_fibers_load : stage_fibers)(&in, &p->out.fibers, err);
    p->plan->geometry = p->out.fibers.geometry;
    return s;
}

static status do_directions(struct pipeline *p, const struct taken *t, bool load, struct error *err)
{
    const struct directions_input in = {p->tools, p->in->section.scan, p->in->n_model, p->in->model};
    struct directions_output *out = &p->out.directions;
    if (p->out.orientation.direction.density != NULL || p->out.fibers.fiber.n_fiber > 0) {
        out->option = t->fibers->option;
        out->geometry = t->fibers->geometry;
        fiber_set_release(&out->fiber);
        direction_volume_release(&out->direction);
        out->fiber = p->out.fibers.fiber; /* taken over with the direction */
        out->direction = p->out.orientation.direction;
        fiber_set_init(&p->out.fibers.fiber);
        memset(&p->out.orientation.direction, 0, sizeof p->out.orientation.direction);
    }
    status s = (load ? stage_directions_load : stage_directions)(&in, out, err);
    p->plan->geometry = out->geometry;
    return s;
}

/* The cloth takes over the fibers and the voxels of the stages before it. */
static void gather_cloth(struct pipeline *p)
{
    struct made_cloth *cloth = &p->out.cloth;
    cloth->report = p->out.fibers.cloth;
    cloth->number = p->in->number;
    if (!p->in->section.scan->given) {
        cloth->geometry = p->out.fibers.geometry;
        cloth->fiber = p->out.fibers.fiber;
        fiber_set_init(&p->out.fibers.fiber);
        return;
    }
    struct directions_output *from = &p->out.directions;
    cloth->geometry = from->geometry;
    cloth->fiber = from->fiber;
    cloth->traced = from->traced;
    cloth->direction = from->direction;
    fiber_set_init(&from->fiber);
    fiber_set_init(&from->traced);
    memset(&from->direction, 0, sizeof from->direction);
}

static status do_scene(struct pipeline *p, const struct taken *t, bool load, struct error *err)
{
    const struct surface_input surface = {p->tools, p->in->section.results, p->in->section.setup, t->cloth};
    (void)load;
    status s = stage_scene(&p->job, &p->out.cloth, err);
    return s == STATUS_OK && !p->option->pictures ? surface_cloth_check(&surface, err) : s;
}

static status do_fit(struct pipeline *p, const struct taken *t, bool load, struct error *err)
{
    const struct fit_input in = {&p->job, pipeline_plan_usual_paths(p->plan), t->cloth};
    const struct profile_fit_input profile = {p->tools,       p->in->section.fit, p->in->section.profile, &p->in->fiber,
                                              p->in->n_model, p->in->model,       p->plan->profile_s};
    if (p->in->kind == JOB_OF_PROFILE) return stage_profile_fit(&profile, &p->out.fit, err);
    return (load ? stage_fit_load : stage_fit)(&in, &p->out.fit, err);
}

static status do_validation(struct pipeline *p, const struct taken *t, bool load, struct error *err)
{
    const struct validation_input in = {&p->job, t->fit->model, t->cloth};
    return (load ? stage_validation_load : stage_validation)(&in, &p->out.validation, err);
}

static status do_report(struct pipeline *p, const struct taken *t, bool load, struct error *err)
{
    const struct job_sections *section = &p->in->section;
    const struct report_input in = {.job = &p->job,
                                    .sample = section->cloth->sample,
                                    .kind = p->in->kind,
                                    .photographs = section->rows,
                                    .profile = section->profile,
                                    .results = section->results,
                                    .files = &p->files,
                                    .statements = p->in->files,
                                    .fiber = &p->in->fiber,
                                    .texture = &p->in->texture,
                                    .option = section->scan->given ? &t->directions->option : &t->fibers->option,
                                    .fit = t->fit->model,
                                    .radius = &t->fit->radius,
                                    .validation = t->validation->model,
                                    .made = t->cloth,
                                    .helper = p->option->helper,
                                    .n_input_warning = p->n_input_warning,
                                    .stage_wall_s = p->stage_wall_s,
                                    .work_s = p->plan->report_s};
    (void)load;
    return p->option->pictures ? stage_pictures(&in, err) : stage_report(&in, &p->out.report, err);
}

/* In the order of pipeline_stage_table (a test compares the names). */
static const struct stage {
    const char *name;
    unsigned takes; /* outputs of earlier stages */
    status (*run)(struct pipeline *p, const struct taken *t, bool load, struct error *err);
    bool stores; /* false: the stage is cheap, or always runs */
} stage_list[] = {
    {"volume", 0, do_volume, .stores = true},
    {"orientation", VOLUME, do_orientation, .stores = true},
    {"fibers", VOLUME | ORIENTATION, do_fibers, .stores = true},
    {"directions", ORIENTATION | FIBERS, do_directions, .stores = true},
    {"scene", CLOTH, do_scene},
    {"fit", CLOTH, do_fit, .stores = true},
    {"validation", CLOTH | FIT, do_validation, .stores = true},
    {"report", FIBERS | DIRECTIONS | CLOTH | FIT | VALIDATION, do_report},
};
enum { N_STAGE = sizeof stage_list / sizeof *stage_list };

/* ---- running them ---- */

static struct taken taken_of(struct outputs *out, unsigned takes)
{
    return (struct taken){.volume = takes & VOLUME ? &out->volume : NULL,
                          .orientation = takes & ORIENTATION ? &out->orientation : NULL,
                          .fibers = takes & FIBERS ? &out->fibers : NULL,
                          .directions = takes & DIRECTIONS ? &out->directions : NULL,
                          .cloth = takes & CLOTH ? &out->cloth : NULL,
                          .fit = takes & FIT ? &out->fit : NULL,
                          .validation = takes & VALIDATION ? &out->validation : NULL};
}

/* Releases the voxels of the scan once no later stage takes them. */
static void release_scan(struct pipeline *p, size_t i_done)
{
    for (size_t i = i_done + 1; i < N_STAGE; i++)
        if (stage_list[i].takes & VOLUME) return;
    volume_release(&p->out.volume.volume);
    memset(&p->out.volume.volume, 0, sizeof p->out.volume.volume);
}

static void report_fraction(void *context, double fraction)
{
    struct pipeline *p = context;
    p->plan->stage_fraction = fraction;
    worker_status_fraction(p->tools->status, fraction);
}

static void plan_hollow(void *context, const size_t n[3])
{
    pipeline_plan_hollow(((struct pipeline *)context)->plan, n);
}

static void plan_fit_paths(void *context, double n_path)
{
    pipeline_plan_fit_paths(((struct pipeline *)context)->plan, n_path);
}

/* Removes the marks of stage i and of all later ones: when it runs, their stored outputs are out of date. */
static status unmark_from(const struct pipeline *p, size_t i, struct error *err)
{
    status s = STATUS_OK;
    for (; i < N_STAGE && s == STATUS_OK; i++)
        s = worker_folder_unmark_stage(p->tools->folder, stage_list[i].name, err);
    return s;
}

/* A finished stage is loaded; if its checkpoint cannot be read it runs again, and so do all later ones. */
static status do_stage(struct pipeline *p, size_t i, bool *earlier_ran, bool *loaded, struct error *err)
{
    const struct stage *stage = &stage_list[i];
    const struct stage_tools *tools = p->tools;
    const struct taken taken = taken_of(&p->out, stage->takes);
    const bool stores = stage->stores && p->in->kind != JOB_OF_PROFILE;
    const char *geometry_job = p->in->section.scan->geometry_job;
    double start_s = clock_monotonic_s();
    if (stores && !*earlier_ran && worker_folder_stage_done(tools->folder, stage->name)) {
        struct error why = {0};
        if (stage->run(p, &taken, true, &why) == STATUS_OK) {
            log_info(tools->log, "stage %s: done by an earlier attempt", stage->name);
            *loaded = true;
            return STATUS_OK;
        }
        if (geometry_job[0] != '\0' && !(stage->takes & CLOTH))
            return job_option_name_field(pipeline_geometry_lost(geometry_job, why.text, err), err);
        if (p->option->pictures)
            return error_set(err, STATUS_NOT_FOUND, "no pictures without stage %s: %.300s", stage->name, why.text);
        log_warning(tools->log, "stage %s runs again: %s", stage->name, why.text);
    }
    if (stores && p->option->pictures)
        return error_set(err, STATUS_NOT_FOUND, "no pictures without stage %s, whose output is gone", stage->name);
    status s = stores && !*earlier_ran ? unmark_from(p, i, err) : STATUS_OK;
    if (stores) *earlier_ran = true;
    log_info(tools->log, "stage %s", stage->name);
    struct rank_traffic before = {.n_share = 0};
    worker_team_begin_stage(tools->pool, &before);
    if (s == STATUS_OK) s = stage->run(p, &taken, false, err);
    if (s != STATUS_OK) return job_option_name_field(s, err);
    p->stage_wall_s[i] = clock_monotonic_s() - start_s;
    log_info(tools->log, "stage %s: %.1f s", stage->name, p->stage_wall_s[i]);
    worker_team_end_stage(tools->pool, &before, stage->name, tools->log);
    return worker_folder_mark_stage(tools->folder, stage->name, err);
}

static bool has_stage(const struct pipeline *p, const struct pipeline_stage_info *info)
{
    return pipeline_stage_applies(info, p->in->kind, p->in->section.scan->given);
}

static status run_stages(struct pipeline *p, struct error *err)
{
    size_t n_stage;
    const struct pipeline_stage_info *info = pipeline_stage_table(&n_stage);
    bool earlier_ran = false, gathered = false;
    for (size_t i = 0; i < n_stage; i++) {
        if (!has_stage(p, &info[i])) continue;
        if (info[i].of_fit && p->out.fit.model == NULL) p->n_input_warning = worker_status_n_warning(p->tools->status);
        if (stage_list[i].takes & CLOTH && !gathered) gather_cloth(p);
        gathered = gathered || stage_list[i].takes & CLOTH;
        bool loaded = false;
        for (size_t later = i; later < n_stage; later++)
            if (has_stage(p, &info[later])) pipeline_plan_stage(p->plan, info[later].name, later);
        p->plan->stage_fraction = 0.0;
        worker_status_stage(p->tools->status, info[i].name, info[i].title, i, n_stage);
        status s = do_stage(p, i, &earlier_ran, &loaded, err);
        if (s == STATUS_OK && !loaded && p->in->section.scan->given && !p->option->pictures)
            s = first_results_write(&p->job, info[i].name, &p->out.volume, &p->out.fibers.fiber, &p->out.cloth, err);
        worker_status_stage_end(p->tools->status, loaded);
        release_scan(p, i);
        if (s == STATUS_OK && progress_cancelled(&p->tools->progress))
            s = error_set(err, STATUS_CANCELLED, "cancelled");
        if (s != STATUS_OK) return s;
    }
    return STATUS_OK;
}

static status open_space(struct pipeline *p, struct error *err)
{
    char work[WORKER_PATH_BYTES];
    if (p->tools->memory_limit_bytes == 0) return STATUS_OK;
    worker_folder_path(p->tools->folder, JOB_FOLDER_WORK, NULL, work);
    status s = scratch_space_new(work, p->tools->memory_limit_bytes, &p->tools->space, err);
    if (s == STATUS_OK) scratch_space_bound(p->tools->space, p->option->most_scratch_bytes);
    return s;
}

static void add_file(void *context, const char *name, const char *role)
{
    struct job_outline *o = context;
    struct job_outline_file *file = &o->file[o->n_file];
    if (o->file != NULL) *file = (struct job_outline_file){.role = role};
    if (o->file != NULL) memcpy(file->name, name, strlen(name) + 1);
    o->n_file++;
}

/* Lists the input files of the document. */
static status list_files(const struct job_inputs *in, struct job_outline *files, struct error *err)
{
    job_sections_visit_files(&in->section, add_file, files);
    files->file = calloc(files->n_file + 1, sizeof *files->file);
    if (files->file == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot run the job: out of memory");
    files->n_file = 0;
    job_sections_visit_files(&in->section, add_file, files);
    return STATUS_OK;
}

static void pipeline_init(struct pipeline *p)
{
    const struct job_sections *section = &p->in->section;
    fiber_set_init(&p->out.fibers.fiber);
    fiber_set_init(&p->out.directions.fiber);
    fiber_set_init(&p->out.directions.traced);
    for (size_t i = 0; i < MAX_STAGE; i++) p->stage_wall_s[i] = NAN;
    p->job = (struct cloth_job){.tools = p->tools,
                                .scan = section->scan,
                                .cloth = section->cloth,
                                .setup = section->setup,
                                .fit = section->fit,
                                .rows = &p->in->rows,
                                .n_model = p->in->n_model,
                                .model = p->in->model,
                                .number = &p->in->number,
                                .seed = p->in->section.fit->seed};
    p->plan->fit = &p->out.fit;
    p->plan->validation = &p->out.validation;
    p->tools->fingerprint = p->in->fingerprint;
    p->tools->plan = (struct stage_plan){p, plan_hollow, plan_fit_paths};
    p->tools->progress =
        (struct progress){.report = report_fraction, .context = p, .cancel = worker_status_cancel(p->tools->status)};
}

static void pipeline_release(struct pipeline *p)
{
    volume_release(&p->out.volume.volume);
    direction_volume_release(&p->out.orientation.direction);
    fiber_set_release(&p->out.fibers.fiber);
    fiber_set_release(&p->out.directions.fiber);
    fiber_set_release(&p->out.directions.traced);
    direction_volume_release(&p->out.directions.direction);
    made_cloth_release(&p->out.cloth);
    fit_output_release(&p->out.fit, p->in->n_model);
    validation_output_release(&p->out.validation, p->in->n_model);
    scratch_space_free(p->tools->space);
    job_outline_release(&p->files);
    p->tools->space = NULL;
    p->tools->plan = (struct stage_plan){.context = NULL};
    p->tools->progress = (struct progress){.report = NULL};
}

status pipeline_run(struct stage_tools *tools, const struct job_inputs *inputs, const struct pipeline_option *option,
                    struct job_plan *plan, struct error *err)
{
    struct pipeline *p = calloc(1, sizeof *p);
    if (p == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot run the job: out of memory");
    *p = (struct pipeline){.tools = tools, .in = inputs, .option = option, .plan = plan};
    pipeline_init(p);
    status s = open_space(p, err);
    if (s == STATUS_OK) s = list_files(inputs, &p->files, err);
    if (s == STATUS_OK && inputs->kind == JOB_OF_PICTURES) s = fit_output_given(inputs, &p->out.fit, err);
    if (s == STATUS_OK && inputs->kind == JOB_OF_PICTURES) s = validation_output_given(inputs, &p->out.validation, err);
    if (s == STATUS_OK && inputs->kind == JOB_OF_FIT && !option->pictures)
        s = first_photographs_write(&p->job, inputs->section.rows, err);
    if (s == STATUS_OK) s = run_stages(p, err);
    pipeline_release(p);
    free(p);
    return s;
}
