#include "optimizer/report/export/twin_result.h"

#include "base/files/durable.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/job/document/json_number.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/stages/validation/pipeline_choice.h"
#include "optimizer/stages/validation/pipeline_discrepancy.h"
#include "renderer/scene/scene_ray.h"

#include <stdlib.h>
#include <string.h>

/* Sizes of the tables: the grids of a cloth that is shown from both sides have fewer directions on each, because there
 * are four pairs of sides. */
enum { BASIS = 16, VIEW_EDGE = 12, LIGHT_EDGE = 16, VIEW_EDGE_OF_TWO = 8, LIGHT_EDGE_OF_TWO = 10 };
/* Points of fibers for close views: 2 MB. */
enum { MOST_POINTS = 65536 };

double twin_result_paths(const struct job_results *results)
{
    /* A path with its sixteen lights takes as long as about so many of a photograph: on weaves of 12 to 40 fibers a
     * yarn it took 25 to 50 us. */
    const double lights = 5.0;
    return results->twin ? lights * ((double)results->twin_paths + appearance_table_fixed_paths(results->twin_texels))
                         : 0.0;
}

static json_t *lamp_json(const struct report *report)
{
    const struct job_setup *d = report->in.job->setup;
    return json_pack("{s:f, s:f, s:f, s:b}", "lamp_distance_mm", 10.0 * d->lamp_distance_cm, "lamp_side_mm",
                     10.0 * d->lamp_side_cm, "camera_distance_mm", 10.0 * d->camera_distance_cm, "far_field",
                     d->camera_far_field);
}

static status write_json(const struct report *report, const struct appearance_table *t, json_t *parts, size_t n_byte,
                         struct error *err)
{
    char path[WORKER_PATH_BYTES];
    json_t *json = json_pack("{s:s, s:s, s:s, s:[f, f], s:f, s:b, s:I, s:I, s:o, s:o, s:o, s:o, s:I, s:o, s:o}",
                             "format", "selvedge-twin.v2", "sample", report->in.sample, "model",
                             report->model[report_best_model(report)].setup->appearance.id, "tile_mm", t->tile_mm[0],
                             t->tile_mm[1], "thickness_mm", scene_thickness_mm(report->in.made->scene), "black_sheet",
                             report->in.job->setup->black_sheet, "paths", (json_int_t)report->in.results->twin_paths,
                             "bytes", (json_int_t)n_byte, "mean_rel_rms", json_number(t->mean_rel_rms),
                             "mean_rel_noise", json_number(t->mean_rel_noise), "all_rel_rms",
                             json_number(t->all_rel_rms), "all_rel_noise", json_number(t->all_rel_noise), "smoothed",
                             (json_int_t)t->n_smooth, "setup", lamp_json(report), "parts", parts);
    char *text = json != NULL ? json_dumps(json, JSON_INDENT(1)) : NULL;
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, "twin/twin.json", path);
    status s = text != NULL ? worker_folder_replace(report->in.job->tools->folder, path, text, strlen(text), err)
                            : error_set(err, STATUS_NO_MEMORY, "cannot write '%s': out of memory", path);
    free(text);
    json_decref(json);
    return s;
}

/* twin.json is written last: it says that the tables are whole. */
static bool is_finished(const struct report *report)
{
    char path[WORKER_PATH_BYTES];
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, "twin/twin.json", path);
    json_t *json = json_load_file(path, 0, NULL);
    bool same = json_integer_value(json_object_get(json, "paths")) == (json_int_t)report->in.results->twin_paths;
    json_decref(json);
    return same;
}

static status write_files(const struct report *report, const struct appearance_table *t, const struct near_fibers *f,
                          struct error *err)
{
    char path[WORKER_PATH_BYTES], *block = NULL;
    size_t n_byte;
    json_t *parts = NULL;
    struct progress silent = progress_silent(&report->in.job->tools->progress);
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, "twin", path);
    status s = durable_make_folder(path, err);
    if (s == STATUS_OK) s = twin_file_make(t, f, &silent, &block, &n_byte, &parts, err);
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, "twin/twin.bin", path);
    if (s == STATUS_OK) s = worker_folder_replace(report->in.job->tools->folder, path, block, n_byte, err);
    free(block);
    if (s == STATUS_OK) return write_json(report, t, parts, n_byte, err);
    json_decref(parts);
    return s;
}

status twin_result_write(struct report *report, double from, double to, struct error *err)
{
    if (!report->in.results->twin || is_finished(report)) return STATUS_OK;
    const struct pipeline_model *m = &report->model[report_best_model(report)];
    if (m->setup->appearance.kind != MODEL_SURFACE) {
        worker_status_warn(report->in.job->tools->status, "no twin for the browser: the model '%s' sees no fibers",
                           m->setup->appearance.id);
        return STATUS_OK;
    }
    const bool two = !report->in.job->setup->black_sheet;
    const struct appearance_table_option o = {.texels = report->in.results->twin_texels,
                                              .view_edge = two ? VIEW_EDGE_OF_TWO : VIEW_EDGE,
                                              .light_edge = two ? LIGHT_EDGE_OF_TWO : LIGHT_EDGE,
                                              .n_basis = BASIS,
                                              .n_path = report->in.results->twin_paths,
                                              .seed = report->in.job->seed ^ 0x7477696eu};
    const struct radiance_input in = {.scene = made_cloth_scene(report->in.made, m->setup),
                                      .model = &m->setup->appearance,
                                      .param = m->fit->result.param,
                                      .n_set = m->setup->sets.n_set,
                                      .discrepancy = pipeline_discrepancy(m->validation)};
    struct appearance_table t;
    struct near_fibers f = {0};
    struct progress_part part;
    struct progress progress = progress_begin_part(&part, &report->in.job->tools->progress, from, to - from),
                    silent = progress_silent(&progress);
    status s = appearance_table_make(&in, &o, report->in.job->tools->pool, &progress, &t, err);
    if (s != STATUS_OK) return s;
    s = near_fibers_make(&in, MOST_POINTS, report->in.job->tools->pool, &silent, &f, err);
    if (s == STATUS_OK) s = write_files(report, &t, &f, err);
    near_fibers_release(&f);
    if (s == STATUS_OK)
        log_info(report->in.job->tools->log,
                 "twin: means in random directions differ from the table by %.1f %%, of which noise %.1f %%",
                 100.0 * t.mean_rel_rms, 100.0 * t.mean_rel_noise);
    appearance_table_release(&t);
    return s;
}
