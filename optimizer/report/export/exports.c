#include "optimizer/report/export/exports.h"

#include "base/files/durable.h"
#include "base/option_id.h"
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/job/document/json_number.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/report/export/earlier_hair.h"
#include "optimizer/report/export/export_scene.h"
#include "optimizer/report/export/hair_on_cloth.h"
#include "optimizer/stages/validation/pipeline_choice.h"
#include "optimizer/stages/validation/pipeline_discrepancy.h"
#include "renderer/scene/scene_ray.h"

#include <math.h>
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
static const double most_row_error = 0.1; /* of a cloth that is exported without a warning */

/* known: e->hair has the mixtures. */
static status fit_materials(struct export_scene *e, bool known, struct error *err)
{
    const struct appearance *a = &e->model->setup->appearance;
    status s = STATUS_OK;
    for (size_t g = 0; g < e->model->setup->sets.n_set && s == STATUS_OK; g++) {
        const double *param = e->model->fit->result.param + g * e->model->setup->sets.n_own;
        const struct hair_blend earlier = e->hair[g].blend;
        s = hair_fit_run(a->surface, param, known ? &earlier : NULL, &e->hair[g], err);
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

/* Adds the errors of the cloth with the materials of a format to its entry. */
static void state_error(const struct export_scene *e, const struct hair_error *h, double deviation, json_t *json)
{
    if (!h->stated) return;
    json_t *rows = json_array();
    json_object_set_new(json, "rel_rms", json_number(hypot(h->rel_rms, deviation)));
    json_object_set_new(json, "row_rel_rms", json_number(hypot(h->row_rel_rms, deviation)));
    if (h->row_rel_rms_se > 0.0) json_object_set_new(json, "row_rel_rms_se", json_number(h->row_rel_rms_se));
    for (size_t i = 0; i < e->report->in.job->rows->observation.n; i++)
        json_array_append_new(rows, json_number(hypot(h->row_rel_error[i], deviation)));
    json_object_set_new(json, "row_rel_errors", rows);
    if (deviation > 0.0) json_object_set_new(json, "program_deviation", json_number(deviation));
}

/* Whether exact.xml takes sections to lie flat that the model saw turn with their fibers. */
static bool misses_sections(const struct export_scene *e, size_t i)
{
    return exports[i].format == &export_mitsuba && export_mitsuba_is_exact(e) &&
           e->model->setup->appearance.surface->flat_section &&
           scene_has_sections(made_cloth_scene(e->report->in.made, e->model->setup).fibers);
}

static const char no_hair_error[] = "the hair materials are those nearest to single fibers, with no error of the cloth "
                                    "stated: its groups of fibers are more than such a fit has room for";
static const char no_sections[] = "exact.xml of the export for Mitsuba takes the flat sections of the fibers to lie "
                                  "flat in the cloth, because curves "
                                  "of Mitsuba are round; in this job's renderings they turn as they were measured";

static const char no_films[] = "the exported fibers are without the films and sequins of the cloth, which hair "
                               "materials cannot show; the stated errors do not contain that";
static const char mean_films[] = "exported textures contain the films and sequins of the cloth in their means over the "
                                 "tile, without glitter";

/* Sentence about the films of the cloth for format i; NULL: it has none. */
static const char *about_films(const struct export_scene *e, size_t i)
{
    if (e->films.n == 0) return NULL;
    return exports[i].format->has_hair ? no_films : mean_films;
}

/* Adds what people need to know of a format with this error to its entry. */
static void state_warnings(const struct export_scene *e, size_t i, const struct hair_error *h, json_t *json)
{
    const double deviation = exports[i].format->deviation;
    json_t *list = json_array();
    if (exports[i].format->has_hair && !h->stated) json_array_append_new(list, json_string(no_hair_error));
    if (h->stated && hypot(h->row_rel_rms, deviation) > most_row_error)
        json_array_append_new(list, json_sprintf("the cloth with these materials differs from this job's renderings by "
                                                 "%.0f %% over its rows",
                                                 percent * hypot(h->row_rel_rms, deviation)));
    if (about_films(e, i) != NULL) json_array_append_new(list, json_string(about_films(e, i)));
    if (misses_sections(e, i)) json_array_append_new(list, json_string(no_sections));
    if (h->stated && deviation > 0.0)
        json_array_append_new(list, json_sprintf("the program's own renderings of these materials are some %.0f %% "
                                                 "off, which the error contains; other programs are nearer",
                                                 percent * deviation));
    json_object_set_new(json, "warnings", list);
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
    if (exports[i].format == &export_mitsuba)
        json_object_set_new(json, "exact", json_boolean(export_mitsuba_is_exact(e)));
    const struct hair_error *error = exports[i].format->has_hair ? &e->hair_error : &e->own_error;
    state_error(e, error, exports[i].format->deviation, json);
    state_warnings(e, i, error, json);
    free(e->own_error.row_rel_error);
    e->own_error = (struct hair_error){.stated = false};
    s = write_conversion(e, json, err);
    if (s == STATUS_OK)
        json_array_append_new(e->report->exports, json);
    else
        json_decref(json);
    return s;
}

static void warn_of_hair(const struct export_scene *e)
{
    if (!e->hair_error.stated)
        worker_status_warn(e->report->in.job->tools->status, "exports: %s", no_hair_error);
    else if (e->hair_error.row_rel_rms > most_row_error)
        worker_status_warn(e->report->in.job->tools->status,
                           "with the hair materials that other programs have, the cloth differs from this job's "
                           "renderings by %.0f %% over its rows%s",
                           percent * e->hair_error.row_rel_rms,
                           export_mitsuba_is_exact(e) ? "; exact.xml of the export for Mitsuba shows it as it is" : "");
}

static void warn_of_rest(const struct export_scene *e)
{
    int n[2];
    for (size_t i = 0; i < N_FORMAT; i++)
        if (e->report->in.results->exported[i] && misses_sections(e, i))
            worker_status_warn(e->report->in.job->tools->status, "%s", no_sections);
    for (size_t i = 0, known[2] = {0}; i < N_FORMAT; i++)
        if (e->report->in.results->exported[i] && about_films(e, i) != NULL &&
            known[exports[i].format->has_hair]++ == 0)
            worker_status_warn(e->report->in.job->tools->status, "%s", about_films(e, i));
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

/* Whether a format that the job asks for has hair materials. */
static bool hair_wanted(const struct job_results *results)
{
    for (size_t i = 0; i < N_FORMAT; i++)
        if (results->exported[i] && exports[i].format->has_hair) return true;
    return false;
}

size_t exports_count(const struct job_results *results)
{
    size_t n = 0;
    for (size_t i = 0; i < N_FORMAT; i++) n += results->exported[i];
    return n;
}

double exports_paths(const struct job_results *results, size_t n_row, double n_fit_path)
{
    double n = hair_wanted(results) ? hair_on_cloth_paths(n_fit_path) : 0.0;
    for (size_t i = 0; i < N_FORMAT; i++)
        if (results->exported[i] && exports[i].format->paths != NULL)
            n += exports[i].format->paths(results, n_row, n_fit_path);
    return n;
}

/* Fits the hair materials in the first part of the progress. */
static status fit_hair(struct export_scene *e, struct progress_part *part, struct error *err)
{
    const struct job_results *results = e->report->in.results;
    const double n_fit_path = (double)e->model->fit->result.n_path, whole = part->share;
    const size_t n_row = e->report->in.job->rows->observation.n;
    const double share = hair_on_cloth_paths(n_fit_path) / exports_paths(results, n_row, n_fit_path);
    bool known;
    if (!hair_wanted(results)) return STATUS_OK;
    status s = earlier_hair_read(e, &known, err);
    if (s == STATUS_OK) s = fit_materials(e, known, err);
    if (s == STATUS_OK && !known) s = hair_on_cloth_run(e, 0.0, share, err);
    if (s == STATUS_OK && known)
        log_info(e->report->in.job->tools->log, "exports: the hair materials are those of an earlier export");
    if (s == STATUS_OK) warn_of_hair(e);
    part->from += share * whole;
    part->share -= share * whole;
    return s;
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
    job_cloth_films(report->in.job->cloth, &e.films);
    fiber_set_z_range_m(&report->in.made->fiber, &e.z_low_m, &e.z_high_m);
    status s = fit_hair(&e, &part, err);
    for (size_t i = 0; i < N_FORMAT && s == STATUS_OK; i++)
        if (report->in.results->exported[i]) s = write_format(&e, i, err);
    if (s == STATUS_OK) warn_of_rest(&e);
    free(e.hair_error.row_rel_error);
    return s;
}
