#include "optimizer/report/result/table_lobes.h"
#include "base/angle.h"
#include "base/files/durable.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/job/document/json_number.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/report/lobes/cloth_sphere.h"
#include "optimizer/report/lobes/table_lamps.h"
#include "optimizer/report/result/result_json.h"
#include "optimizer/report/result/result_pictures.h"
#include "optimizer/report/result/result_thumbnail.h"
#include "renderer/estimate/estimate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { LEAST_ANGLE = 17, MOST_ANGLE = 33, LEAST_PATHS = 256, SPHERE_PX = 128 };
static const double widest_rad = 80.0 * RAD_PER_DEG;
static const uint64_t sphere_seed = 0x737068657265u, lobe_seed = 0x6c6f6265u;

static const struct observation_set *rows_of(const struct report *report) { return &report->in.job->rows->observation; }

static void path_of(const struct report *report, const char *name, const char *ending, char path[WORKER_PATH_BYTES])
{
    char relative[300];
    snprintf(relative, sizeof relative, "renderings/%s%s", name, ending);
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, relative, path);
}

/* ---- spheres ---- */

static status write_sphere(struct report *report, size_t i, const char *name, double n_path,
                           const struct progress *progress, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    struct image im;
    double noise;
    path_of(report, name, ".png", path); /* written last of the two */
    if (access(path, F_OK) == 0) return STATUS_OK;
    const size_t px = report->in.results->render_px;
    const struct sphere_request q = {.input = result_radiance_input(report),
                                     .row = &rows_of(report)->item[i].configuration,
                                     .black_sheet = report->in.job->setup->black_sheet,
                                     .px = px > 0 ? px : SPHERE_PX,
                                     .n_path = (size_t)n_path,
                                     .seed = report->in.job->seed ^ sphere_seed};
    status s = cloth_sphere_render(&q, report->in.job->tools->pool, progress, &im, &noise, err);
    if (s != STATUS_OK) return s;
    log_info(report->in.job->tools->log, "sphere under the lamp of row '%s': noise of a place %.1f %%", name,
             100.0 * noise);
    s = result_image_write(report, &im, "renderings", name, result_png_exposure(rows_of(report)), true, err);
    if (s == STATUS_OK && i == 0) s = result_thumbnail_of_image(report, &im, err);
    image_release(&im);
    return s;
}

/* ---- lobes ---- */

/* The radiance over the camera's angle in the plane of row i. */
static status estimate_lobe(struct report *report, size_t i, size_t n_angle, double n_path,
                            const struct progress *progress, json_t *lobe, struct error *err)
{
    const struct configuration *row = &rows_of(report)->item[i].configuration;
    const double plane = row->light_phi_rad + table_camera_of(row).plane_rad;
    struct configuration view[MOST_ANGLE];
    struct estimate estimate[MOST_ANGLE];
    size_t n[MOST_ANGLE];
    for (size_t k = 0; k < n_angle; k++) {
        const double theta = widest_rad * (2.0 * (double)k / (double)(n_angle - 1) - 1.0);
        const bool right =
            table_camera_of(&(struct configuration){
                                .light_phi_rad = row->light_phi_rad, .camera_phi_rad = plane, .camera_theta_rad = 1.0})
                .theta_rad > 0.0;
        view[k] = *row;
        view[k].contrast_cells = 0;
        view[k].camera_theta_rad = fabs(theta);
        view[k].camera_phi_rad = plane + ((theta > 0.0) == right ? 0.0 : M_PI);
        n[k] = (size_t)(n_path / (double)n_angle) + 1;
        json_array_append_new(json_object_get(lobe, "camera_theta_deg"), json_real(theta * DEG_PER_RAD));
    }
    const struct estimate_request q = {.input = result_radiance_input(report),
                                       .configuration = view,
                                       .n_configuration = n_angle,
                                       .n_path = n,
                                       .seed = report->in.job->seed ^ lobe_seed};
    status s = estimate_run(&q, report->in.job->tools->pool, progress, estimate, err);
    for (size_t k = 0; s == STATUS_OK && k < n_angle; k++) {
        double se[3];
        for (int c = 0; c < 3; c++) se[c] = sqrt(estimate[k].var[c]);
        json_array_append_new(json_object_get(lobe, "rendered"), json_number_list(estimate[k].mean, 3, 1.0));
        json_array_append_new(json_object_get(lobe, "rendered_se"), json_number_list(se, 3, 1.0));
    }
    return s;
}

static status write_lobes(struct report *report, double n_path, const struct progress *progress, struct error *err)
{
    const struct observation_set *o = rows_of(report);
    const double n_lobe = (double)table_lobe_count(o);
    char path[WORKER_PATH_BYTES];
    path_of(report, "lobes", ".json", path);
    if (access(path, F_OK) == 0) return STATUS_OK;
    json_t *lobes = json_array();
    status s = STATUS_OK;
    double done = 0.0;
    for (size_t i = 0; i < o->n && s == STATUS_OK; i++) {
        if (table_lobe_row(o, i) != i) continue;
        const double n_rotation = fmax((double)o->item[i].configuration.n_rotation, 1.0);
        const double n_angle = floor(n_path / n_lobe / (LEAST_PATHS * n_rotation));
        struct progress_part part;
        struct progress inner = progress_begin_part(&part, progress, done++ / n_lobe, 1.0 / n_lobe);
        json_t *lobe =
            json_pack("{s:s, s:[], s:[], s:[]}", "row", o->item[i].name, "camera_theta_deg", "rendered", "rendered_se");
        s = estimate_lobe(report, i, (size_t)fmin(fmax(n_angle, LEAST_ANGLE), MOST_ANGLE) | 1, n_path / n_lobe, &inner,
                          lobe, err);
        json_array_append_new(lobes, lobe);
    }
    char *text = s == STATUS_OK ? json_dumps(lobes, JSON_REAL_PRECISION(17) | JSON_INDENT(1)) : NULL;
    if (s == STATUS_OK && text == NULL) s = error_set(err, STATUS_NO_MEMORY, "cannot write lobes: out of memory");
    if (s == STATUS_OK) s = worker_folder_replace(report->in.job->tools->folder, path, text, strlen(text), err);
    free(text);
    json_decref(lobes);
    return s;
}

status table_lobes_write(struct report *report, double from, double to, struct error *err)
{
    const struct observation_set *o = rows_of(report);
    const double n_lamp = (double)table_lamp_count(o), middle = 0.5 * (from + to);
    const double n_path = result_renderings_paths(report->in.results, o->n,
                                                  (double)report->model[report_best_model(report)].fit->result.n_path);
    double done = 0.0;
    char folder[WORKER_PATH_BYTES];
    struct progress_part part;
    picture_name *name = NULL;
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, "renderings", folder);
    status s = durable_make_folder(folder, err);
    if (s == STATUS_OK) s = result_picture_names(o, &name, err);
    for (size_t i = 0; i < o->n && s == STATUS_OK; i++) {
        if (table_lamp_row(o, i) != i) continue;
        struct progress progress =
            progress_begin_part(&part, &report->in.job->tools->progress, from + (middle - from) * done++ / n_lamp,
                                (middle - from) / n_lamp);
        s = write_sphere(report, i, name[i], 0.5 * n_path / n_lamp, &progress, err);
    }
    free(name);
    struct progress progress = progress_begin_part(&part, &report->in.job->tools->progress, middle, to - middle);
    return s == STATUS_OK ? write_lobes(report, 0.5 * n_path, &progress, err) : s;
}
