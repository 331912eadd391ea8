#include "optimizer/worker/report/result_pictures.h"
#include "base/files/durable.h"
#include "geometry/volume/format/vol_file.h"
#include "optimizer/fit/photographs/photograph.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/worker/report/cloth/scan_slices.h"
#include "optimizer/worker/report/result_json.h"
#include "optimizer/worker/report/result_thumbnail.h"
#include "optimizer/worker/stages/result/pipeline_choice.h"
#include "optimizer/worker/stages/result/pipeline_discrepancy.h"
#include "renderer/transport/render.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* The path RESULTS/<folder>/<name><ending>, and a temporary one in the same folder. The temporary name has the same
 * ending, because writers choose the format by it. */
static void picture_paths(const struct pipeline_context *c, const char *folder, const char *name, const char *ending,
                          char path[WORKER_PATH_BYTES], char temporary[WORKER_PATH_BYTES])
{
    char relative[300];
    snprintf(relative, sizeof relative, "%s%s%s%s", folder, folder[0] != '\0' ? "/" : "", name, ending);
    worker_folder_path(c->folder, JOB_FOLDER_RESULTS, relative, path);
    snprintf(relative, sizeof relative, "%s%s.part-%s%s", folder, folder[0] != '\0' ? "/" : "", name, ending);
    worker_folder_path(c->folder, JOB_FOLDER_RESULTS, relative, temporary);
}

/* Renames `temporary` to `path` when writing it succeeded, and removes it otherwise. */
static status put_in_place(const struct pipeline_context *c, status written, const char *temporary, const char *path,
                           struct error *err)
{
    status s = written == STATUS_OK ? worker_folder_check(c->folder, err) : written;
    if (s == STATUS_OK) return durable_rename(temporary, path, err);
    unlink(temporary);
    return s;
}

static bool exists(const char *path) { return access(path, F_OK) == 0; }

static status make_folder(const struct pipeline_context *c, const char *name, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    worker_folder_path(c->folder, JOB_FOLDER_RESULTS, name, path);
    return durable_make_folder(path, err);
}

/* ---- geometry ---- */

static status write_fibers(const struct pipeline_context *c, struct error *err)
{
    char path[WORKER_PATH_BYTES], temporary[WORKER_PATH_BYTES];
    picture_paths(c, "", "fibers", ".hair", path, temporary);
    status s = put_in_place(c, fiber_set_write_hair(&c->fiber, temporary, err), temporary, path, err);
    if (s != STATUS_OK) return s;
    picture_paths(c, "", "fibers", ".txt", path, temporary);
    return put_in_place(c, fiber_set_write_text(&c->fiber, temporary, err), temporary, path, err);
}

static status write_volumes(const struct pipeline_context *c, struct error *err)
{
    char path[WORKER_PATH_BYTES], temporary[WORKER_PATH_BYTES];
    picture_paths(c, "", "direction", ".vol", path, temporary);
    status s = exists(path) ? STATUS_OK
                            : put_in_place(c, vol_write_direction(temporary, &c->direction, VOL_QUANTISED, err),
                                           temporary, path, err);
    picture_paths(c, "", "density", ".vol", path, temporary);
    if (s != STATUS_OK || exists(path)) return s;
    return put_in_place(c, vol_write_kept_density(temporary, &c->direction, err), temporary, path, err);
}

status result_picture_write(const struct pipeline_context *c, const char *name, const uint8_t *rgb, size_t width,
                            size_t height, struct error *err)
{
    char path[WORKER_PATH_BYTES], temporary[WORKER_PATH_BYTES];
    status s = make_folder(c, "pictures", err);
    if (s != STATUS_OK) return s;
    picture_paths(c, "pictures", name, ".png", path, temporary);
    return put_in_place(c, image_write_png_rgb8(rgb, width, height, temporary, err), temporary, path, err);
}

static status write_slice(const struct pipeline_context *c, int axis, struct error *err)
{
    static const char *const name[] = {"slice-x", "slice-y", "slice-z"};
    uint8_t *rgb = NULL;
    size_t width, height;
    status s =
        reconstruct_slice_picture(&c->volume, &c->traced, axis, c->volume.n[axis] / 2, &rgb, &width, &height, err);
    if (s != STATUS_OK) return s;
    s = result_picture_write(c, name[axis], rgb, width, height, err);
    if (s == STATUS_OK && axis == 2) s = result_thumbnail_of_bytes(c, rgb, width, height, err);
    free(rgb);
    return s;
}

status result_geometry_write(struct pipeline_context *c, struct error *err)
{
    status s = write_fibers(c, err);
    if (s != STATUS_OK || !c->doc->scan.given) return s;
    s = write_volumes(c, err);
    if (s == STATUS_OK) s = pipeline_need_volume(c, err);
    for (int axis = 0; axis < 3 && s == STATUS_OK; axis++) s = write_slice(c, axis, err);
    return s == STATUS_OK ? scan_slices_write(c, err) : s;
}

/* ---- renderings ---- */

status result_image_write(const struct pipeline_context *c, const struct image *im, const char *folder,
                          const char *name, double exposure, bool exr, struct error *err)
{
    char path[WORKER_PATH_BYTES], temporary[WORKER_PATH_BYTES];
    status s = STATUS_OK;
    if (exr) {
        picture_paths(c, folder, name, ".exr", path, temporary);
        s = put_in_place(c, image_write_exr(im, temporary, err), temporary, path, err);
    }
    picture_paths(c, folder, name, ".png", path, temporary);
    return s == STATUS_OK ? put_in_place(c, image_write_png(im, exposure, temporary, err), temporary, path, err) : s;
}

static status write_photograph(const struct pipeline_context *c, size_t i, const char *name, double exposure,
                               struct error *err)
{
    char path[WORKER_PATH_BYTES];
    struct image im;
    worker_folder_path(c->folder, JOB_FOLDER_INPUT, NULL, path);
    status s = photograph_develop(&c->process, path, &c->doc->rows.photograph[i], &im, NULL, err);
    if (s != STATUS_OK) return s;
    s = result_image_write(c, &im, "photographs", name, exposure, true, err);
    image_release(&im);
    return s;
}

/* Without numbers in the job document, all renderings together take this share of the paths of the best model's fit,
 * within these bounds: pictures do not cost more than the fit. */
static const double picture_share = 0.5, least_sample = 2.0, most_sample = 16.0, least_px = 48.0;

size_t result_picture_px(const struct pipeline_context *c, double n_fit_path)
{
    const double sample = c->doc->results.render_sample > 0 ? (double)c->doc->results.render_sample : least_sample;
    if (c->doc->results.render_px > 0) return c->doc->results.render_px;
    double px = floor(sqrt(picture_share * n_fit_path / (sample * (double)c->observation.n)));
    return (size_t)fmin(fmax(px, least_px), (double)RESULT_PICTURE_PX);
}

size_t result_picture_samples(const struct pipeline_context *c, double n_fit_path)
{
    if (c->doc->results.render_sample > 0) return c->doc->results.render_sample;
    const double px = (double)result_picture_px(c, n_fit_path), n = (double)c->observation.n;
    double paths = picture_share * n_fit_path;
    return (size_t)fmin(fmax(floor(paths / (px * px * n)), least_sample), most_sample);
}

double result_renderings_paths(const struct pipeline_context *c, double n_fit_path)
{
    const double px = (double)result_picture_px(c, n_fit_path);
    return px * px * (double)c->observation.n * (double)result_picture_samples(c, n_fit_path);
}

static status write_rendering(struct pipeline_context *c, size_t i, const char *name, double exposure,
                              const struct progress *progress, struct error *err)
{
    char path[WORKER_PATH_BYTES], temporary[WORKER_PATH_BYTES];
    struct image im;
    picture_paths(c, "renderings", name, ".png", path, temporary); /* written last of the two */
    if (exists(path)) return STATUS_OK;
    const struct pipeline_model *m = &c->model[pipeline_best_model(c)];
    const size_t px = result_picture_px(c, (double)m->fit.n_path);
    const struct render_request q = {.input = {.scene = pipeline_scene(c, m),
                                               .model = &m->appearance,
                                               .param = m->fit.param,
                                               .n_set = m->sets.n_set,
                                               .discrepancy = pipeline_discrepancy(m)},
                                     .configuration = &c->observation.item[i].configuration,
                                     .width = px,
                                     .height = px,
                                     .n_sample = result_picture_samples(c, (double)m->fit.n_path),
                                     .seed = c->doc->fit.seed ^ 0x70696374757265u,
                                     .stream = (uint32_t)i};
    status s = render_run(&q, c->pool, progress, &im, err);
    if (s != STATUS_OK) return s;
    s = result_image_write(c, &im, "renderings", name, exposure, true, err);
    if (s == STATUS_OK && i == 0) s = result_thumbnail_of_image(c, &im, err);
    image_release(&im);
    return s;
}

status result_renderings_write(struct pipeline_context *c, double from, double to, struct error *err)
{
    picture_name *name = NULL;
    double exposure = result_png_exposure(&c->observation);
    size_t n = c->observation.n;
    status s = result_picture_names(&c->observation, &name, err);
    if (s == STATUS_OK) s = make_folder(c, "renderings", err);
    if (s == STATUS_OK && c->doc->rows.n_photograph > 0) s = make_folder(c, "photographs", err);
    if (s == STATUS_OK && c->process.chart_picture.pixel != NULL) s = make_folder(c, "pictures", err);
    if (s == STATUS_OK && c->process.chart_picture.pixel != NULL)
        s = result_image_write(c, &c->process.chart_picture, "pictures", "color-chart", 1.0, false, err);
    for (size_t i = 0; i < c->doc->rows.n_photograph && s == STATUS_OK; i++)
        s = write_photograph(c, i, name[i], exposure, err);
    for (size_t i = 0; i < n && s == STATUS_OK; i++) {
        struct progress_part part;
        struct progress progress = progress_begin_part(&part, &c->progress, from + (to - from) * (double)i / (double)n,
                                                       (to - from) / (double)n);
        s = write_rendering(c, i, name[i], exposure, &progress, err);
    }
    free(name);
    return s;
}
