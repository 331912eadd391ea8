#include "optimizer/report/surface/surface_tables.h"
#include "base/files/durable.h"
#include "base/process.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/job/document/json_number.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/stages/validation/pipeline_choice.h"
#include "renderer/fast/precompute/fast_precompute.h"
#include "renderer/scene/scene_ray.h"

#include <stdio.h>
#include <unistd.h>

/* Three traced hits leave a third of the error of one (renderer/fast/NOTES.md); the transfer to a cell has an error of
 * 1 to 2 % by so many paths. */
enum { N_TRACED = 3, CELL_PATHS = 8000, SPREAD_PATHS = 1024 };
enum { LOOK_TEXELS = 256, LOOK_EDGE = 8, LOOK_BASIS = 4, LOOK_PATHS = 100000 };
/* Samples of a picture for a path of the fit, and the most paths, which take six seconds of a processor. By a
 * quarter as many for 64 x 64 pixels no half of gabardine's paths served the other. */
enum { SAMPLES_OF_FIT = 1, MOST_FIT = 1 << 18 };
/* Two hits before diffusion leave its means without a part that stays (renderer/quick/diffusion-notes.md). */
enum { N_TRACED_IN_PILE = 2 };
#define JOURNAL_EVERY_S 2.0
/* Density for dual scattering: cloth is dense (fabric thesis, section 6.6). */
#define DENSITY 1.0f
/* Rough processor seconds on a twill of 26,000 segments: of a path of the table of directions, of a path of all cells,
 * of the tables of visible directions, and of a sample of a picture by tables and path by path. */
static const double deep_path_s = 12e-6, cell_path_s = 3e-3, visibility_s = 60.0, fast_sample_s = 5e-6,
                    fast_studio_sample_s = 9e-6, path_sample_s = 20e-6;

/* Pictures of a studio have tables of their own, because no black sheet lies under their cloth. */
static bool is_of(const struct job_surface_picture *p, bool studio)
{
    return (p->kind != JOB_KIND_MEASUREMENT) == studio;
}

/* Returns whether a picture takes the visibility of its segments from tables. */
static bool wants_visibility(const struct job_results *results, bool studio)
{
    for (size_t i = 0; i < results->n_surface_picture; i++) {
        const struct job_surface_picture *p = &results->surface_picture[i];
        if (is_of(p, studio) && p->visibility_by_tables) return true;
    }
    return false;
}

static bool wants_tables(const struct job_results *results, bool studio)
{
    for (size_t i = 0; i < results->n_surface_picture; i++) {
        const struct job_surface_picture *p = &results->surface_picture[i];
        if (is_of(p, studio) && p->method == JOB_PICTURE_FAST) return true;
    }
    return false;
}

/* Returns whether a picture takes light that is scattered often from the table of directions. Otherwise from cells. */
static bool by_directions(const struct job_surface_picture *p)
{
    return p->method == JOB_PICTURE_FAST && !p->visibility_by_tables && !p->deep_by_cells;
}

/* Paths for that table; 0: no picture asks for it. */
static size_t deep_paths(const struct job_results *results, bool studio)
{
    size_t n = 0;
    for (size_t i = 0; i < results->n_surface_picture; i++) {
        const struct job_surface_picture *p = &results->surface_picture[i];
        if (is_of(p, studio) && by_directions(p) && p->n_deep_path > n) n = p->n_deep_path;
    }
    return n;
}

/* The first picture by cells, with which all others agree (option_checks_fit.c); NULL: there is none. */
static const struct job_surface_picture *of_cells(const struct job_results *results, bool studio)
{
    for (size_t i = 0; i < results->n_surface_picture; i++) {
        const struct job_surface_picture *p = &results->surface_picture[i];
        if (is_of(p, studio) && p->method == JOB_PICTURE_FAST && !by_directions(p)) return p;
    }
    return NULL;
}

/* Paths of a cell; without a picture by cells they only say how far light spreads. */
static uint32_t cell_paths(const struct job_results *results, bool studio)
{
    return of_cells(results, studio) != NULL ? CELL_PATHS : SPREAD_PATHS;
}

/* Filters take the albedo of fibers from the averages. */
static bool wants_averages(const struct job_results *results, bool of_filters)
{
    for (size_t i = 0; i < results->n_surface_picture; i++) {
        const struct job_surface_picture *p = &results->surface_picture[i];
        if (p->method == JOB_PICTURE_DUAL || (of_filters && p->filter)) return true;
    }
    return false;
}

static bool wants_method(const struct job_results *results, enum job_picture_method m)
{
    for (size_t i = 0; i < results->n_surface_picture; i++)
        if (results->surface_picture[i].method == m) return true;
    return false;
}

double surface_tables_paths(const struct job_results *results)
{
    double seconds = 0.0;
    for (int studio = 0; studio < 2; studio++)
        if (wants_tables(results, studio))
            seconds += deep_path_s * (double)deep_paths(results, studio) + cell_path_s * cell_paths(results, studio) +
                       (wants_visibility(results, studio) ? visibility_s : 0.0);
    return seconds / path_sample_s;
}

double surface_sample_paths(const struct job_surface_picture *p)
{
    const bool studio = p->kind != JOB_KIND_MEASUREMENT;
    const double fast_s = studio ? fast_studio_sample_s : fast_sample_s;
    return (p->method == JOB_PICTURE_FAST ? fast_s / path_sample_s : 1.0) + (p->reference ? 1.0 : 0.0);
}

/* Reads or makes the tables that are kept as work/report/<name>.tables. */
static status get_tables(struct report *report, bool studio, const struct scene *scene, const struct progress *progress,
                         struct fast_tables *t, struct error *err)
{
    const struct job_results *results = report->in.results;
    const struct pipeline_model *model = &report->model[report_best_model(report)];
    const struct job_surface_picture *cells = of_cells(results, studio);
    const char *name = studio ? "studio" : "fast";
    char path[WORKER_PATH_BYTES], journal[WORKER_PATH_BYTES], relative[64];
    const struct fast_precompute_request q = {.scene = scene,
                                              .model = model->setup->appearance.surface,
                                              .param = model->fit->result.param,
                                              .n_set = model->setup->sets.n_set,
                                              .order = cells != NULL ? (uint32_t)cells->cell_order : 0,
                                              .cell_paths = cells != NULL ? cells->cell_free_paths : 0.0,
                                              .n_path = cell_paths(results, studio),
                                              .no_visibility = !wants_visibility(results, studio),
                                              .deep_traced = deep_paths(results, studio) > 0 ? N_TRACED : 0,
                                              .deep_paths = (double)deep_paths(results, studio),
                                              .journal_path = journal,
                                              .journal_every_s = JOURNAL_EVERY_S};
    snprintf(relative, sizeof relative, "report/%s.journal", name);
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_WORK, relative, journal);
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_WORK, "report", path);
    status s = durable_make_folder(path, err);
    if (s != STATUS_OK) return s;
    snprintf(relative, sizeof relative, "report/%s.tables", name);
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_WORK, relative, path);
    struct error unread;
    const status kept = fast_precompute_kept(&q, path, t, &unread);
    if (kept == STATUS_OK) {
        unlink(journal); /* of an attempt that ended after it had written the tables */
        return STATUS_OK;
    }
    if (kept != STATUS_NOT_FOUND) log_info(report->in.job->tools->log, "tables are made anew: %s", unread.text);
    const double before_s = process_use().cpu_s;
    s = fast_precompute(&q, report->in.job->tools->pool, progress, t, err);
    if (s != STATUS_OK) return s;
    log_info(report->in.job->tools->log, "tables of light: processor %.2f s", process_use().cpu_s - before_s);
    s = fast_tables_write(t, path, err);
    if (s == STATUS_OK && unlink(journal) != 0) s = error_set_errno(err, "cannot remove '%s'", path_file_name(journal));
    return s;
}

static status get_studio_tables(struct report *report, const struct progress *progress, struct surface_tables *t,
                                struct error *err)
{
    const struct scene *scene = report->in.made->scene;
    struct scene *lifted = NULL;
    status s = scene_has_black_sheet(scene) ? scene_lift(scene, &lifted, err) : STATUS_OK;
    if (s == STATUS_OK) s = get_tables(report, true, lifted != NULL ? lifted : scene, progress, &t->studio, err);
    scene_free(lifted);
    t->has_studio = s == STATUS_OK;
    return s;
}

static status get_pile(struct report *report, const struct progress *progress, struct surface_tables *t,
                       struct error *err)
{
    const struct pipeline_model *model = &report->model[report_best_model(report)];
    const struct diffusion_request q = {.scene = report->in.made->scene,
                                        .model = model->setup->appearance.surface,
                                        .param = model->fit->result.param,
                                        .n_set = model->setup->sets.n_set,
                                        .n_traced = N_TRACED_IN_PILE};
    struct progress silent = progress_silent(progress);
    status s = diffusion_tables_make(&q, report->in.job->tools->pool, &silent, &t->pile, err);
    t->piled = s == STATUS_OK;
    return s;
}

/* The mean appearance of the flat cloth, from so many paths with sixteen lights each: seconds, so it is not stored. */
static status get_look(struct report *report, const struct progress *progress, struct surface_tables *t,
                       struct error *err)
{
    const struct pipeline_model *model = &report->model[report_best_model(report)];
    const struct appearance_table_option o = {.texels = LOOK_TEXELS,
                                              .view_edge = LOOK_EDGE,
                                              .light_edge = LOOK_EDGE,
                                              .n_basis = LOOK_BASIS,
                                              .n_path = LOOK_PATHS,
                                              .seed = report->in.job->seed ^ 0x6c6f6f6bu};
    const struct radiance_input in = {.scene = made_cloth_scene(report->in.made, model->setup),
                                      .model = &model->setup->appearance,
                                      .param = model->fit->result.param,
                                      .n_set = model->setup->sets.n_set};
    struct progress silent = progress_silent(progress);
    status s = appearance_table_make(&in, &o, report->in.job->tools->pool, &silent, &t->look, err);
    t->looked = s == STATUS_OK;
    return s;
}

status surface_tables_get(struct report *report, const struct progress *progress, struct surface_tables *t,
                          struct error *err)
{
    const struct pipeline_model *model = &report->model[report_best_model(report)];
    const bool tables = wants_tables(report->in.results, false), studio = wants_tables(report->in.results, true),
               averages = wants_averages(report->in.results, true),
               pile = wants_method(report->in.results, JOB_PICTURE_DIFFUSION),
               look = wants_method(report->in.results, JOB_PICTURE_SHEARED);
    *t = (struct surface_tables){0};
    if (!tables && !studio && !averages && !pile && !look) return STATUS_OK;
    if (model->setup->appearance.kind != MODEL_SURFACE ||
        scattering_frame_reason(model->setup->appearance.surface) != NULL) {
        if (tables || studio || pile || look || wants_averages(report->in.results, false))
            worker_status_warn(report->in.job->tools->status,
                               "all pictures are rendered path by path: there are no tables for the model '%s'",
                               model->setup->appearance.id);
        return STATUS_OK;
    }
    status s = STATUS_OK;
    if (averages) {
        struct progress silent = progress_silent(progress);
        s = dual_tables_init(&t->averages, report->in.made->scene, model->setup->appearance.surface,
                             model->fit->result.param, model->setup->sets.n_set, report->in.job->tools->pool, &silent,
                             err);
        t->averaged = s == STATUS_OK;
    }
    if (s == STATUS_OK && look) s = get_look(report, progress, t, err);
    if (s == STATUS_OK && pile) s = get_pile(report, progress, t, err);
    if (s == STATUS_OK && studio) s = get_studio_tables(report, progress, t, err);
    if (s != STATUS_OK || !tables) return s;
    s = get_tables(report, false, report->in.made->scene, progress, &t->tables, err);
    t->present = s == STATUS_OK;
    return s;
}

void surface_tables_release(struct surface_tables *t)
{
    fast_tables_release(&t->tables);
    fast_tables_release(&t->studio);
    dual_tables_release(&t->averages);
    appearance_table_release(&t->look);
}

struct surface_method surface_tables_method(const struct surface_tables *t, const struct job_surface_picture *p)
{
    const bool studio = p->kind != JOB_KIND_MEASUREMENT;
    const bool has = p->method == JOB_PICTURE_DUAL        ? t->averaged
                     : p->method == JOB_PICTURE_DIFFUSION ? t->piled
                     : p->method == JOB_PICTURE_SHEARED   ? t->looked
                     : studio                             ? t->has_studio
                                                          : t->present;
    return (struct surface_method){.method = has ? p->method : JOB_PICTURE_PATH,
                                   .fast = {.tables = studio ? &t->studio : &t->tables,
                                            .visibility = p->visibility_by_tables ? FAST_TABLES : FAST_TRACED,
                                            .n_traced = N_TRACED,
                                            .deep = by_directions(p)},
                                   .dual = {&t->averages, DENSITY, DENSITY},
                                   .diffusion = {&t->pile},
                                   .look = &t->look};
}

void surface_method_apply(const struct surface_method *m, struct radiance_input *input)
{
    input->fast = m->method == JOB_PICTURE_FAST ? &m->fast : NULL;
    input->dual = m->method == JOB_PICTURE_DUAL ? &m->dual : NULL;
    input->diffusion = m->method == JOB_PICTURE_DIFFUSION ? &m->diffusion : NULL;
}

status surface_fit_make(const struct report *report, struct render_request *q, const struct progress *progress,
                        struct surface_fit *fit, struct error *err)
{
    *fit = (struct surface_fit){0};
    if (q->input.fast == NULL || !q->input.fast->deep) return STATUS_OK;
    const size_t share = q->width * q->height * q->n_sample / SAMPLES_OF_FIT;
    const double before_s = process_use().cpu_s;
    struct progress silent = progress_silent(progress);
    status s = deep_fit_make(&q->input, q->configuration, share < MOST_FIT ? share : MOST_FIT, q->seed,
                             report->in.job->tools->pool, &silent, &fit->deep, err);
    if (s != STATUS_OK) return s;
    fit->made = true;
    fit->fast = *q->input.fast;
    fit->fast.factor = fit->deep.used ? &fit->deep.factor : NULL;
    q->input.fast = &fit->fast;
    log_info(report->in.job->tools->log, "deep light fitted: processor %.2f s, %.1f +- %.1f %% from the tables",
             process_use().cpu_s - before_s, 100.0 * fit->deep.difference, 100.0 * fit->deep.error);
    return STATUS_OK;
}

void surface_fit_put(json_t *entry, const struct surface_fit *fit)
{
    if (!fit->made) return;
    json_object_set_new(entry, "tables",
                        json_pack("{s:o, s:o, s:o, s:b}", "error", json_number((double)fit->fast.tables->deep.error),
                                  "difference", json_number(fit->deep.difference), "difference_se",
                                  json_number(fit->deep.error), "fitted", fit->deep.used));
}
