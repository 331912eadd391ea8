#include "optimizer/worker/report/surface/surface_pictures.h"
#include "base/files/durable.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/worker/report/json_number.h"
#include "optimizer/worker/report/result_json.h"
#include "optimizer/worker/report/result_pictures.h"
#include "optimizer/worker/report/result_thumbnail.h"
#include "optimizer/worker/report/surface/surface_cloth.h"
#include "optimizer/worker/report/surface/surface_passes.h"
#include "optimizer/worker/report/surface/surface_tables.h"
#include "optimizer/worker/stages/result/pipeline_choice.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { STREAM = 4000 };
static const double mm = 1e-3;

static const char *const method_name[] = {"path", "fast", "corrected"};
static const char *const surface_name[] = {"flat", "cylinder", "drape", "mesh"};

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

/* Mean radiance of each channel, and the root mean square of the pixels' standard errors over the mean brightness. */
static json_t *picture_json(const struct job_surface_picture *p, const struct surface_passes *so_far, double exposure)
{
    const struct image *im = &so_far->image;
    double mean[3] = {0.0, 0.0, 0.0}, variance = 0.0;
    size_t n = im->width * im->height;
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < 3; k++) {
            mean[k] += (double)im->pixel[i * im->n_channel + k] / (double)n;
            variance += (double)im->pixel[i * im->n_channel + 3 + k] / (3.0 * (double)n);
        }
    double brightness = (mean[0] + mean[1] + mean[2]) / 3.0;
    char file[80];
    snprintf(file, sizeof file, "pictures/%s.exr", so_far->name);
    return json_pack("{s:s, s:s, s:s, s:I, s:[o, o, o], s:o, s:o}", "file", file, "on", surface_name[p->on], "method",
                     method_name[p->method], "samples", (json_int_t)so_far->n_sample, "mean", json_number(mean[0]),
                     json_number(mean[1]), json_number(mean[2]), "noise",
                     json_number(brightness > 0.0 && p->sample > 1 ? sqrt(variance) / brightness : NAN), "png_exposure",
                     json_number(exposure));
}

/* Means over the columns of the picture, as profiles across a cylinder are compared. */
static status write_columns(const struct pipeline_context *c, const struct job_surface_picture *p,
                            const struct surface_passes *done, struct error *err)
{
    const struct image *im = &done->image;
    char *text = NULL, path[WORKER_PATH_BYTES], relative[64];
    size_t n_byte;
    FILE *f = open_memstream(&text, &n_byte);
    if (f == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot write a table: no memory");
    fputs("x_mm,r,g,b,r_se,g_se,b_se\n", f);
    for (size_t x = 0; x < im->width; x++) {
        double sum[6] = {0.0};
        for (size_t y = 0; y < im->height; y++)
            for (int k = 0; k < 6; k++) sum[k] += (double)im->pixel[(y * im->width + x) * im->n_channel + (size_t)k];
        fprintf(f, "%.6g", p->width_mm * (((double)x + 0.5) / (double)im->width - 0.5));
        for (int k = 0; k < 6; k++) fprintf(f, ",%.6g", (k < 3 ? sum[k] : sqrt(sum[k])) / (double)im->height);
        fputc('\n', f);
    }
    status s = fclose(f) == 0 ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot write a table: no memory");
    snprintf(relative, sizeof relative, "pictures/%s-columns.csv", done->name);
    worker_folder_path(c->folder, JOB_FOLDER_RESULTS, relative, path);
    if (s == STATUS_OK) s = worker_folder_replace(c->folder, path, text, n_byte, err);
    free(text);
    return s;
}

/* The picture so far as PNG; in the end also as EXR, and its columns. */
static status write_picture(struct pipeline_context *c, const struct job_surface_picture *p,
                            const struct surface_passes *so_far, double exposure, struct error *err)
{
    bool whole = so_far->n_sample == p->sample;
    status s = result_image_write(c, &so_far->image, "pictures", so_far->name, exposure, whole, err);
    if (s == STATUS_OK && whole) s = result_thumbnail_of_image(c, &so_far->image, err);
    return s == STATUS_OK && whole ? write_columns(c, p, so_far, err) : s;
}

/* The entry of result.json lies beside the picture and is written last: a picture is finished when its entry has all
 * samples. *out: the entry, of which the caller has a reference. */
static status write_entry(struct pipeline_context *c, const char *path, const struct job_surface_picture *p,
                          const struct surface_passes *so_far, json_t **out, struct error *err)
{
    double exposure = exposure_of(&so_far->image);
    status s = write_picture(c, p, so_far, exposure, err);
    if (s != STATUS_OK) return s;
    json_t *entry = picture_json(p, so_far, exposure);
    char *text = entry != NULL ? json_dumps(entry, JSON_INDENT(1) | JSON_REAL_PRECISION(17)) : NULL;
    s = text != NULL ? worker_folder_replace(c->folder, path, text, strlen(text), err)
                     : error_set(err, STATUS_NO_MEMORY, "cannot write '%s': out of memory", path);
    free(text);
    json_decref(*out);
    *out = entry;
    return s;
}

/* One picture of the document. */
struct one_picture {
    size_t i;
    const struct surface_tables *tables;
    const char *entry_path;
};

/* Renders pass by pass until all samples are there. */
static status render(struct pipeline_context *c, const struct one_picture *one, const struct progress *progress,
                     struct surface_passes *so_far, json_t **entry, struct error *err)
{
    size_t i = one->i;
    const struct job_surface_picture *p = &c->doc->surface_picture[i];
    struct fast_option fast;
    bool by_tables = surface_tables_option(one->tables, p, &fast);
    const struct pipeline_model *model = &c->model[pipeline_best_model(c)];
    struct surface_cloth cloth;
    struct configuration view = observation_configuration(
        c->doc, p->light_theta_deg, p->light_phi_deg, p->camera_theta_deg, p->camera_phi_deg, p->cloth_rotation_deg);
    view.crop_m = mm * p->width_mm;
    view.crop_aspect = 1.0;
    view.environment = c->environment;
    status s = surface_cloth_init(c, i, model->appearance.kind, &cloth, err);
    if (s != STATUS_OK) {
        surface_cloth_release(&cloth);
        return s;
    }
    const struct render_request q = {
        .input = {.scene = {.fibers = cloth.fibers, .volume = cloth.volume.bent != NULL ? &cloth.volume : NULL},
                  .model = &model->appearance,
                  .param = model->fit.param,
                  .n_set = model->sets.n_set,
                  .fast = by_tables ? &fast : NULL},
        .configuration = &view,
        .width = p->px,
        .height = p->px,
        .n_sample = p->sample,
        .seed = c->doc->seed ^ 0x73757266616365u,
        .stream = (uint32_t)(STREAM + i)};
    while (s == STATUS_OK && so_far->n_sample < p->sample) {
        s = surface_passes_add(c, &q, progress, so_far, err);
        if (s == STATUS_OK) s = write_entry(c, one->entry_path, p, so_far, entry, err);
    }
    if (s == STATUS_OK && *entry == NULL) s = write_entry(c, one->entry_path, p, so_far, entry, err);
    surface_cloth_release(&cloth);
    return s == STATUS_OK || s == STATUS_CANCELLED ? s : error_prefix(err, s, "picture %zu", i + 1);
}

static status write_one(struct pipeline_context *c, size_t i, const struct surface_tables *tables,
                        const struct progress *progress, struct error *err)
{
    const struct job_surface_picture *p = &c->doc->surface_picture[i];
    char name[32], relative[64], path[WORKER_PATH_BYTES];
    struct surface_passes so_far;
    snprintf(name, sizeof name, "on-%zu", i + 1);
    snprintf(relative, sizeof relative, "pictures/%s.json", name);
    worker_folder_path(c->folder, JOB_FOLDER_RESULTS, relative, path);
    json_t *entry = json_load_file(path, 0, NULL);
    if (entry != NULL && json_integer_value(json_object_get(entry, "samples")) == (json_int_t)p->sample)
        return json_array_append_new(c->surface_pictures, entry) == 0 ? STATUS_OK : STATUS_NO_MEMORY;
    json_decref(entry);
    entry = NULL;
    status s = surface_passes_start(c, name, p->px, p->px, &so_far, err);
    if (s == STATUS_OK) s = render(c, &(struct one_picture){i, tables, path}, progress, &so_far, &entry, err);
    if (s == STATUS_OK)
        json_array_append_new(c->surface_pictures, entry);
    else
        json_decref(entry);
    surface_passes_release(&so_far);
    return s;
}

status surface_pictures_write(struct pipeline_context *c, double from, double to, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    double done = 0.0, all = surface_pictures_paths(c);
    if (c->doc->n_surface_picture == 0) return STATUS_OK;
    worker_folder_path(c->folder, JOB_FOLDER_RESULTS, "pictures", path);
    status s = durable_make_folder(path, err);
    struct surface_tables tables = {0};
    double for_tables = (to - from) * surface_tables_share(c);
    struct progress_part making;
    struct progress make = progress_begin_part(&making, &c->progress, from, for_tables);
    if (s == STATUS_OK) s = surface_tables_get(c, &make, &tables, err);
    from += for_tables;
    for (size_t i = 0; i < c->doc->n_surface_picture && s == STATUS_OK; i++) {
        const struct job_surface_picture *p = &c->doc->surface_picture[i];
        double share = (to - from) * (double)p->px * (double)p->px * (double)p->sample / all;
        struct progress_part part;
        struct progress progress = progress_begin_part(&part, &c->progress, from + done, share);
        s = write_one(c, i, &tables, &progress, err);
        done += share;
    }
    surface_tables_release(&tables);
    return s;
}
