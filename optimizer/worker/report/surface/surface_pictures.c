#include "optimizer/worker/report/surface/surface_pictures.h"
#include "base/files/durable.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/worker/report/json_number.h"
#include "optimizer/worker/report/result_json.h"
#include "optimizer/worker/report/result_pictures.h"
#include "optimizer/worker/report/surface/surface_cloth.h"
#include "optimizer/worker/stages/result/pipeline_choice.h"
#include "renderer/transport/render.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { STREAM = 4000 };
static const double mm = 1e-3;

static const char *const surface_name[] = {"flat", "cylinder", "mesh"};

double surface_pictures_paths(const struct pipeline_context *c)
{
    double n = 0.0;
    for (size_t i = 0; i < c->doc->n_surface_picture; i++) {
        const struct job_surface_picture *p = &c->doc->surface_picture[i];
        n += (double)p->px * (double)p->px * (double)p->sample;
    }
    return n;
}

/* Brings the mean of what is lit to a medium brightness. */
static double exposure_of(const struct image *im)
{
    const double medium = 0.25;
    double sum = 0.0;
    size_t n_lit = 0;
    for (size_t i = 0; i < im->width * im->height; i++) {
        const float *p = im->pixel + i * im->n_channel;
        double brightness = ((double)p[0] + (double)p[1] + (double)p[2]) / 3.0;
        sum += brightness;
        n_lit += brightness > 0.0;
    }
    return sum > 0.0 ? medium * (double)n_lit / sum : 1.0;
}

/* Mean radiance of each channel, and the root mean square of the pixels' standard errors over the mean brightness of
 * what is not black. */
static json_t *picture_json(const struct job_surface_picture *p, const char *name, const struct image *im,
                            double exposure)
{
    double mean[3] = {0.0, 0.0, 0.0}, variance = 0.0;
    size_t n = im->width * im->height;
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < 3; k++) {
            mean[k] += (double)im->pixel[i * im->n_channel + k] / (double)n;
            variance += (double)im->pixel[i * im->n_channel + 3 + k] / (3.0 * (double)n);
        }
    double brightness = (mean[0] + mean[1] + mean[2]) / 3.0;
    char file[80];
    snprintf(file, sizeof file, "pictures/%s.exr", name);
    return json_pack("{s:s, s:s, s:[o, o, o], s:o, s:o}", "file", file, "on", surface_name[p->on], "mean",
                     json_number(mean[0]), json_number(mean[1]), json_number(mean[2]), "noise",
                     json_number(brightness > 0.0 && p->sample > 1 ? sqrt(variance) / brightness : NAN), "png_exposure",
                     json_number(exposure));
}

static status render(struct pipeline_context *c, size_t i, const struct progress *progress, struct image *im,
                     struct error *err)
{
    const struct job_surface_picture *p = &c->doc->surface_picture[i];
    const struct pipeline_model *model = &c->model[pipeline_best_model(c)];
    struct scene *bent = NULL;
    struct configuration view = observation_configuration(
        c->doc, p->light_theta_deg, p->light_phi_deg, p->camera_theta_deg, p->camera_phi_deg, p->cloth_rotation_deg);
    view.crop_m = mm * p->width_mm;
    view.crop_aspect = 1.0;
    view.environment = c->environment;
    status s = surface_cloth_new(c, i, &bent, err);
    if (s != STATUS_OK) return s;
    const struct render_request q = {.input = {.scene = {.fibers = bent},
                                               .model = &model->appearance,
                                               .param = model->fit.param,
                                               .n_set = model->sets.n_set},
                                     .configuration = &view,
                                     .width = p->px,
                                     .height = p->px,
                                     .n_sample = p->sample,
                                     .seed = c->doc->seed ^ 0x73757266616365u,
                                     .stream = (uint32_t)(STREAM + i)};
    s = render_run(&q, c->pool, progress, im, err);
    scene_free(bent);
    return s == STATUS_OK || s == STATUS_CANCELLED ? s : error_prefix(err, s, "picture %zu", i + 1);
}

/* The entry of result.json lies beside the picture and is written last, so that it marks a finished one. */
static status write_entry(struct pipeline_context *c, const char *path, json_t *entry, struct error *err)
{
    char *text = entry != NULL ? json_dumps(entry, JSON_INDENT(1) | JSON_REAL_PRECISION(17)) : NULL;
    status s = text != NULL ? worker_folder_replace(c->folder, path, text, strlen(text), err)
                            : error_set(err, STATUS_NO_MEMORY, "cannot write '%s': out of memory", path);
    free(text);
    if (s == STATUS_OK)
        json_array_append_new(c->surface_pictures, entry);
    else
        json_decref(entry);
    return s;
}

static status write_one(struct pipeline_context *c, size_t i, const struct progress *progress, struct error *err)
{
    char name[32], relative[64], path[WORKER_PATH_BYTES];
    struct image im = {0};
    snprintf(name, sizeof name, "on-%zu", i + 1);
    snprintf(relative, sizeof relative, "pictures/%s.json", name);
    worker_folder_path(c->folder, JOB_FOLDER_RESULTS, relative, path);
    json_t *entry = json_load_file(path, 0, NULL);
    if (entry != NULL) return json_array_append_new(c->surface_pictures, entry) == 0 ? STATUS_OK : STATUS_NO_MEMORY;
    status s = render(c, i, progress, &im, err);
    if (s != STATUS_OK) return s;
    double exposure = exposure_of(&im);
    s = result_image_write(c, &im, "pictures", name, exposure, true, err);
    if (s == STATUS_OK) s = write_entry(c, path, picture_json(&c->doc->surface_picture[i], name, &im, exposure), err);
    image_release(&im);
    return s;
}

status surface_pictures_write(struct pipeline_context *c, double from, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    double done = 0.0, all = surface_pictures_paths(c);
    if (c->doc->n_surface_picture == 0) return STATUS_OK;
    if (c->model[pipeline_best_model(c)].appearance.kind != MODEL_SURFACE) {
        worker_status_warn(c->status, "no picture of the cloth on a surface: the model '%s' sees no fibers",
                           c->model[pipeline_best_model(c)].appearance.id);
        return STATUS_OK;
    }
    worker_folder_path(c->folder, JOB_FOLDER_RESULTS, "pictures", path);
    status s = durable_make_folder(path, err);
    for (size_t i = 0; i < c->doc->n_surface_picture && s == STATUS_OK; i++) {
        const struct job_surface_picture *p = &c->doc->surface_picture[i];
        double share = (1.0 - from) * (double)p->px * (double)p->px * (double)p->sample / all;
        struct progress_part part;
        struct progress progress = progress_begin_part(&part, &c->progress, from + done, share);
        s = write_one(c, i, &progress, err);
        done += share;
    }
    return s;
}
