#include "optimizer/report/export/exports.h"

#include "base/files/durable.h"
#include "base/option_id.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/report/export/export_scene.h"
#include "optimizer/stages/validation/pipeline_choice.h"
#include "optimizer/stages/validation/pipeline_discrepancy.h"

#include <stdlib.h>
#include <string.h>

#undef EXPORT
#define EXPORT(name, ...) extern const struct export_format export_##name;
#include "generated/exports.def"
#undef EXPORT

/* In the order of job_results.exported. */
static const struct {
    const char *name;
    const struct export_format *format;
} exports[] = {
#define EXPORT(name, ...) {#name, &export_##name},
#include "generated/exports.def"
#undef EXPORT
};
enum { N_FORMAT = sizeof exports / sizeof *exports };
static const double percent = 100.0;

static status fit_materials(struct export_scene *e, struct error *err)
{
    const struct appearance *a = &e->model->setup->appearance;
    status s = STATUS_OK;
    for (size_t g = 0; g < e->model->setup->sets.n_set && s == STATUS_OK; g++) {
        s = hair_fit_run(a->surface, e->model->fit->result.param + g * e->model->setup->sets.n_own, &e->hair[g], err);
        if (s != STATUS_OK) break;
        log_info(e->report->in.job->tools->log, "exports: hair lobes differ from the fitted scattering by %.0f %%",
                 percent * e->hair[g].rel_rms);
    }
    return s;
}

/* conversion.json */
static status write_conversion(const struct export_scene *e, const json_t *json, struct error *err)
{
    char path[WORKER_PATH_BYTES], *text = json_dumps(json, JSON_INDENT(1) | JSON_REAL_PRECISION(17));
    if (text == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot export a scene: out of memory");
    export_path(e, "conversion.json", path);
    status s = worker_folder_replace(e->report->in.job->tools->folder, path, text, strlen(text), err);
    free(text);
    return s;
}

static status write_format(struct export_scene *e, size_t i, struct error *err)
{
    char folder[64], path[WORKER_PATH_BYTES];
    json_t *materials = NULL;
    snprintf(folder, sizeof folder, "export/%s", exports[i].name);
    e->folder = folder;
    worker_folder_path(e->report->in.job->tools->folder, JOB_FOLDER_RESULTS, folder, path);
    status s = durable_make_folder(path, err);
    if (s == STATUS_OK) s = exports[i].format->write(e, &materials, err);
    if (s != STATUS_OK) return s;
    json_t *json = json_pack("{s:s, s:s, s:o}", "format", exports[i].name, "folder", folder, "materials", materials);
    s = write_conversion(e, json, err);
    if (s == STATUS_OK)
        json_array_append_new(e->report->exports, json);
    else
        json_decref(json);
    return s;
}

static void warn_of_rest(const struct export_scene *e)
{
    int n[2];
    if (!export_repeats(e, n))
        worker_status_warn(e->report->in.job->tools->status,
                           "the exported scenes have %d x %d repeats of the tile, the most that are written: the "
                           "widest view sees beyond them",
                           n[0], n[1]);
    if (e->report->in.job->rows->environment != NULL)
        worker_status_warn(e->report->in.job->tools->status,
                           "the exported scenes have no image of the surroundings: add '%s' to them",
                           e->report->in.job->setup->environment_file);
    if (pipeline_discrepancy(e->model->validation) != NULL)
        worker_status_warn(
            e->report->in.job->tools->status,
            "the exported fibers are rendered without the discrepancy, which other programs do not know; "
            "exported textures contain it");
}

size_t exports_count(const struct job_results *results)
{
    size_t n = 0;
    for (size_t i = 0; i < N_FORMAT; i++) n += results->exported[i];
    return n;
}

double exports_paths(const struct job_results *results, size_t n_row, double n_fit_path)
{
    double n = 0.0;
    for (size_t i = 0; i < N_FORMAT; i++)
        if (results->exported[i] && exports[i].format->paths != NULL)
            n += exports[i].format->paths(results, n_row, n_fit_path);
    return n;
}

status exports_write(struct report *report, double from, double to, struct error *err)
{
    struct progress_part part;
    struct progress progress = progress_begin_part(&part, &report->in.job->tools->progress, from, to - from);
    struct export_scene e = {
        .report = report, .model = &report->model[report_best_model(report)], .progress = &progress};
    if (exports_count(report->in.results) == 0) return STATUS_OK;
    if (e.model->setup->appearance.kind != MODEL_SURFACE) {
        worker_status_warn(report->in.job->tools->status,
                           "nothing was exported: the model '%s' sees no fibers, which an export needs",
                           e.model->setup->appearance.id);
        return STATUS_OK;
    }
    if (report->in.job->rows->observation.n == 0)
        return error_set_field(err, STATUS_INVALID, OPTION_RESULT_FILE,
                               "nothing can be exported: the result '%s' has no rows, whose lamp and camera the scenes "
                               "take over",
                               report->in.job->fit->result_file);
    fiber_set_z_range_m(&report->in.made->fiber, &e.z_low_m, &e.z_high_m);
    status s = fit_materials(&e, err);
    for (size_t i = 0; i < N_FORMAT && s == STATUS_OK; i++)
        if (report->in.results->exported[i]) s = write_format(&e, i, err);
    if (s == STATUS_OK) warn_of_rest(&e);
    return s;
}
