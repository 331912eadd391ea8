#include "optimizer/report/result/row_pictures.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/report/lobes/table_lamps.h"
#include "renderer/preview/joint_filter.h"

size_t row_pictures_shown(const struct report *report, size_t i)
{
    if (report->in.photographs->n_photograph > 0) return i;
    return table_lamp_row(&report->in.job->rows->observation, i);
}

void row_pictures_put(const struct report *report, const char *rendering, const char *photograph, json_t *row)
{
    const bool shown = report->in.photographs->n_photograph > 0;
    const bool surface = report->model[report_best_model(report)].setup->appearance.kind == MODEL_SURFACE;
    json_object_set_new(row, "rendering_shows", json_string(shown ? "crop" : "sphere"));
    json_object_set_new(row, "rendering_filter",
                        shown && surface && report->in.results->render_sample != 1 ? json_string(JOINT_FILTER_ID)
                                                                                   : json_null());
    json_object_set_new(row, "rendering_png", json_sprintf("renderings/%s.png", rendering));
    json_object_set_new(row, "rendering_exr", json_sprintf("renderings/%s.exr", rendering));
    json_object_set_new(row, "photograph_png", shown ? json_sprintf("photographs/%s.png", photograph) : json_null());
}

void row_pictures_put_lobes(const struct report *report, json_t *json)
{
    char path[WORKER_PATH_BYTES];
    if (report->in.photographs->n_photograph > 0) return;
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, "renderings/lobes.json", path);
    json_t *lobes = json_load_file(path, 0, NULL);
    json_object_set_new(json, "lobes", lobes != NULL ? lobes : json_null());
}
