#include "optimizer/report/result/result_pictures.h"
#include "base/files/durable.h"
#include "geometry/volume/format/vol_file.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/job/document/job_scan.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/photographs/reader/photograph.h"
#include "optimizer/report/geometry/scan_slices.h"
#include "optimizer/report/result/result_json.h"
#include "optimizer/report/result/result_thumbnail.h"
#include "optimizer/stages/validation/pipeline_choice.h"
#include "optimizer/stages/validation/pipeline_discrepancy.h"
#include "renderer/estimate/render.h"
#include "renderer/estimate/render_guides.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* The path RESULTS/<folder>/<name><ending>, and a temporary one in the same folder. The temporary name has the same
 * ending, because writers choose the format by it. */
static void picture_paths(const struct report *report, const char *folder, const char *name, const char *ending,
                          char path[WORKER_PATH_BYTES], char temporary[WORKER_PATH_BYTES])
{
    char relative[300];
    snprintf(relative, sizeof relative, "%s%s%s%s", folder, folder[0] != '\0' ? "/" : "", name, ending);
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, relative, path);
    snprintf(relative, sizeof relative, "%s%s.part-%s%s", folder, folder[0] != '\0' ? "/" : "", name, ending);
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, relative, temporary);
}

/* Renames `temporary` to `path` when writing it succeeded, and removes it otherwise. */
static status put_in_place(const struct report *report, status written, const char *temporary, const char *path,
                           struct error *err)
{
    status s = written == STATUS_OK ? worker_folder_check(report->in.job->tools->folder, err) : written;
    if (s == STATUS_OK) return durable_rename(temporary, path, err);
    unlink(temporary);
    return s;
}

static bool exists(const char *path) { return access(path, F_OK) == 0; }

static status make_folder(const struct report *report, const char *name, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, name, path);
    return durable_make_folder(path, err);
}

/* ---- geometry ---- */

static status write_fibers(const struct report *report, struct error *err)
{
    char path[WORKER_PATH_BYTES], temporary[WORKER_PATH_BYTES];
    picture_paths(report, "", "fibers", ".hair", path, temporary);
    status s =
        put_in_place(report, fiber_set_write_hair(&report->in.made->fiber, temporary, err), temporary, path, err);
    if (s != STATUS_OK) return s;
    picture_paths(report, "", "fibers", ".txt", path, temporary);
    return put_in_place(report, fiber_set_write_text(&report->in.made->fiber, temporary, err), temporary, path, err);
}

static status write_volumes(const struct report *report, struct error *err)
{
    char path[WORKER_PATH_BYTES], temporary[WORKER_PATH_BYTES];
    picture_paths(report, "", "direction", ".vol", path, temporary);
    status s =
        exists(path)
            ? STATUS_OK
            : put_in_place(report, vol_write_direction(temporary, &report->in.made->direction, VOL_QUANTISED, err),
                           temporary, path, err);
    picture_paths(report, "", "density", ".vol", path, temporary);
    if (s != STATUS_OK || exists(path)) return s;
    return put_in_place(report, vol_write_kept_density(temporary, &report->in.made->direction, err), temporary, path,
                        err);
}

status result_picture_write(const struct report *report, const char *name, const uint8_t *rgb, size_t width,
                            size_t height, struct error *err)
{
    char path[WORKER_PATH_BYTES], temporary[WORKER_PATH_BYTES];
    status s = make_folder(report, "pictures", err);
    if (s != STATUS_OK) return s;
    picture_paths(report, "pictures", name, ".png", path, temporary);
    return put_in_place(report, image_write_png_rgb8(rgb, width, height, temporary, err), temporary, path, err);
}

static status write_slice(const struct report *report, const struct volume *volume, const struct fiber_set *traced,
                          int axis, struct error *err)
{
    static const char *const name[] = {"slice-x", "slice-y", "slice-z"};
    uint8_t *rgb = NULL;
    size_t width, height;
    status s = reconstruct_slice_picture(volume, traced, axis, volume->n[axis] / 2, &rgb, &width, &height, err);
    if (s != STATUS_OK) return s;
    s = result_picture_write(report, name[axis], rgb, width, height, err);
    if (s == STATUS_OK && axis == 2) s = result_thumbnail_of_bytes(report, rgb, width, height, err);
    free(rgb);
    return s;
}

status result_slices_write(const struct report *report, const struct volume *volume, const struct fiber_set *traced,
                           struct error *err)
{
    status s = STATUS_OK;
    for (int axis = 0; axis < 3 && s == STATUS_OK; axis++) s = write_slice(report, volume, traced, axis, err);
    return s;
}

status result_geometry_write(struct report *report, struct error *err)
{
    status s = write_fibers(report, err);
    if (s != STATUS_OK || !report->in.job->scan->given) return s;
    s = write_volumes(report, err);
    if (s == STATUS_OK) s = report_need_volume(report, err);
    if (s == STATUS_OK) s = result_slices_write(report, &report->volume.volume, &report->in.made->traced, err);
    return s == STATUS_OK ? scan_slices_write(report, err) : s;
}

/* ---- renderings ---- */

status result_exr_write(const struct report *report, const struct image *im, const char *folder, const char *name,
                        struct error *err)
{
    char path[WORKER_PATH_BYTES], temporary[WORKER_PATH_BYTES];
    picture_paths(report, folder, name, ".exr", path, temporary);
    return put_in_place(report, image_write_exr(im, temporary, err), temporary, path, err);
}

status result_image_write(const struct report *report, const struct image *im, const char *folder, const char *name,
                          double exposure, bool exr, struct error *err)
{
    char path[WORKER_PATH_BYTES], temporary[WORKER_PATH_BYTES];
    status s = exr ? result_exr_write(report, im, folder, name, err) : STATUS_OK;
    picture_paths(report, folder, name, ".png", path, temporary);
    return s == STATUS_OK ? put_in_place(report, image_write_png(im, exposure, temporary, err), temporary, path, err)
                          : s;
}

static status write_photograph(const struct report *report, size_t i, const char *name, double exposure,
                               struct error *err)
{
    char path[WORKER_PATH_BYTES], temporary[WORKER_PATH_BYTES];
    struct image im;
    picture_paths(report, "photographs", name, ".png", path, temporary); /* written last of the two */
    if (exists(path)) return STATUS_OK;
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_INPUT, NULL, path);
    status s = photograph_develop(&report->in.job->rows->process, path, &report->in.photographs->photograph[i], &im,
                                  NULL, err);
    if (s != STATUS_OK) return s;
    s = result_image_write(report, &im, "photographs", name, exposure, true, err);
    image_release(&im);
    return s;
}

/* Time of a rendering with the guides of its filter, over the time of its paths alone. */
static const double guides_cost = 1.2;
/* Without numbers in the job document, all renderings together take this share of the paths of the best model's fit,
 * with guides about half of its time, within these bounds: pictures do not cost more than the fit. */
static const double picture_share = 0.5 / 1.2, least_sample = 4.0, most_sample = 16.0, least_px = 48.0;

size_t result_picture_px(const struct job_results *results, size_t n_row, double n_fit_path)
{
    const double sample = results->render_sample > 0 ? (double)results->render_sample : least_sample;
    if (results->render_px > 0) return results->render_px;
    double px = floor(sqrt(picture_share * n_fit_path / (sample * (double)n_row)));
    return (size_t)fmin(fmax(px, least_px), (double)RESULT_PICTURE_PX);
}

size_t result_picture_samples(const struct job_results *results, size_t n_row, double n_fit_path)
{
    if (results->render_sample > 0) return results->render_sample;
    const double px = (double)result_picture_px(results, n_row, n_fit_path), n = (double)n_row;
    double paths = picture_share * n_fit_path;
    return (size_t)fmin(fmax(floor(paths / (px * px * n)), least_sample), most_sample);
}

double result_renderings_paths(const struct job_results *results, size_t n_row, double n_fit_path)
{
    const double px = (double)result_picture_px(results, n_row, n_fit_path);
    return guides_cost * px * px * (double)n_row * (double)result_picture_samples(results, n_row, n_fit_path);
}

struct radiance_input result_radiance_input(const struct report *report)
{
    const struct pipeline_model *m = &report->model[report_best_model(report)];
    return (struct radiance_input){.scene = made_cloth_scene(report->in.made, m->setup),
                                   .model = &m->setup->appearance,
                                   .param = m->fit->result.param,
                                   .n_set = m->setup->sets.n_set,
                                   .discrepancy = pipeline_discrepancy(m->validation)};
}

static const char *const filtered_name[] = {"R",     "G",          "B",          "var.R",     "var.G",
                                            "var.B", "filtered.R", "filtered.G", "filtered.B"};

/* The mean of two halves of n[0] and n[1] samples, its variance, and the filtered view as a layer. */
static status layers_of(const struct image half[2], const size_t n[2], const struct image *view, struct image *im,
                        struct error *err)
{
    const double all = (double)(n[0] + n[1]), w[2] = {(double)n[0] / all, (double)n[1] / all};
    status s = image_init(im, view->width, view->height, 9, err);
    if (s != STATUS_OK) return s;
    im->channel_name = filtered_name;
    for (size_t i = 0; i < view->width * view->height; i++)
        for (size_t c = 0; c < 3; c++) {
            const float *p[2] = {half[0].pixel + i * half[0].n_channel + c, half[1].pixel + i * half[1].n_channel + c};
            const double mean[2] = {(double)p[0][0], (double)p[1][0]}, apart = mean[0] - mean[1];
            double variance = 0.0;
            /* the sum of squares about the common mean, from those about each half's mean, which one sample has not */
            for (int h = 0; h < 2; h++)
                if (n[h] > 1) variance += (double)p[h][3] * (double)n[h] * (double)(n[h] - 1);
            variance += apart * apart * (double)n[0] * (double)n[1] / all;
            im->pixel[9 * i + c] = (float)(w[0] * mean[0] + w[1] * mean[1]);
            im->pixel[9 * i + 3 + c] = (float)(variance / (all * (all - 1.0)));
            im->pixel[9 * i + 6 + c] = view->pixel[3 * i + c];
        }
    return STATUS_OK;
}

/* Renders the request as two halves and filters them. im: with the filtered view as a layer; view: the filtered view
 * alone. Both are to be released by the caller. */
static status render_filtered(const struct report *report, const struct render_request *q,
                              const struct progress *progress, struct image *im, struct image *view, struct error *err)
{
    struct thread_pool *pool = report->in.job->tools->pool;
    const size_t n[2] = {q->n_sample / 2, q->n_sample - q->n_sample / 2};
    struct image half[2] = {{0}, {0}};
    struct render_guides guides = {0};
    struct progress silent = progress_silent(progress);
    double error;
    status s = STATUS_OK;
    for (int h = 0; h < 2 && s == STATUS_OK; h++) {
        struct render_request part = *q;
        struct progress_part share;
        struct progress inner = progress_begin_part(&share, progress, 0.5 * h, 0.5);
        part.first_sample = h == 0 ? 0 : RENDER_HALF;
        part.n_sample = n[h];
        s = render_run(&part, pool, &inner, &half[h], err);
    }
    if (s == STATUS_OK) s = render_guides_make(q, NULL, pool, &silent, &guides, err);
    if (s == STATUS_OK) s = render_guides_filter(&guides, half, pool, &silent, view, &error, err);
    if (s == STATUS_OK) s = layers_of(half, n, view, im, err);
    render_guides_release(&guides);
    image_release(&half[0]);
    image_release(&half[1]);
    return s;
}

static status write_rendering(struct report *report, size_t i, const char *name, double exposure,
                              const struct progress *progress, struct error *err)
{
    char path[WORKER_PATH_BYTES], temporary[WORKER_PATH_BYTES];
    struct image im = {0}, view = {0};
    picture_paths(report, "renderings", name, ".png", path, temporary); /* written last of the two */
    if (exists(path)) return STATUS_OK;
    const struct pipeline_model *m = &report->model[report_best_model(report)];
    const size_t n_row = report->in.job->rows->observation.n;
    const double n_fit_path = (double)m->fit->result.n_path;
    const size_t px = result_picture_px(report->in.results, n_row, n_fit_path);
    const struct render_request q = {.input = result_radiance_input(report),
                                     .configuration = &report->in.job->rows->observation.item[i].configuration,
                                     .width = px,
                                     .height = px,
                                     .n_sample = result_picture_samples(report->in.results, n_row, n_fit_path),
                                     .seed = report->in.job->seed ^ 0x70696374757265u,
                                     .stream = (uint32_t)i};
    const bool filtered = m->setup->appearance.kind == MODEL_SURFACE && q.n_sample > 1;
    status s = filtered ? render_filtered(report, &q, progress, &im, &view, err)
                        : render_run(&q, report->in.job->tools->pool, progress, &im, err);
    if (s == STATUS_OK) {
        picture_paths(report, "renderings", name, ".exr", path, temporary);
        s = put_in_place(report, image_write_exr(&im, temporary, err), temporary, path, err);
    }
    const struct image *shown = filtered ? &view : &im;
    if (s == STATUS_OK) s = result_image_write(report, shown, "renderings", name, exposure, false, err);
    if (s == STATUS_OK && i == 0) s = result_thumbnail_of_image(report, shown, err);
    image_release(&im);
    image_release(&view);
    return s;
}

status result_photographs_write(const struct report *report, struct error *err)
{
    const struct job_rows *rows = report->in.photographs;
    const struct image *chart = &report->in.job->rows->process.chart_picture;
    picture_name *name = NULL;
    double exposure = result_png_exposure(&report->in.job->rows->observation);
    status s = result_picture_names(&report->in.job->rows->observation, &name, err);
    if (s == STATUS_OK && rows->n_photograph > 0) s = make_folder(report, "photographs", err);
    if (s == STATUS_OK && chart->pixel != NULL) s = make_folder(report, "pictures", err);
    if (s == STATUS_OK && chart->pixel != NULL)
        s = result_image_write(report, chart, "pictures", "color-chart", 1.0, false, err);
    for (size_t i = 0; i < rows->n_photograph && s == STATUS_OK; i++)
        s = write_photograph(report, i, name[i], exposure, err);
    free(name);
    return s;
}

status result_renderings_write(struct report *report, double from, double to, struct error *err)
{
    picture_name *name = NULL;
    double exposure = result_png_exposure(&report->in.job->rows->observation);
    size_t n = report->in.job->rows->observation.n;
    status s = result_photographs_write(report, err);
    if (s == STATUS_OK) s = result_picture_names(&report->in.job->rows->observation, &name, err);
    if (s == STATUS_OK) s = make_folder(report, "renderings", err);
    for (size_t i = 0; i < n && s == STATUS_OK; i++) {
        struct progress_part part;
        struct progress progress =
            progress_begin_part(&part, &report->in.job->tools->progress, from + (to - from) * (double)i / (double)n,
                                (to - from) / (double)n);
        s = write_rendering(report, i, name[i], exposure, &progress, err);
    }
    free(name);
    return s;
}
