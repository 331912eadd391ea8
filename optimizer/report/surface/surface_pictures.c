#include "optimizer/report/surface/surface_pictures.h"
#include "base/catalogue/picture_method.h"
#include "base/files/durable.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/job/document/json_number.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/report/result/result_json.h"
#include "optimizer/report/result/result_pictures.h"
#include "optimizer/report/result/result_thumbnail.h"
#include "optimizer/report/surface/surface_cloth.h"
#include "optimizer/report/surface/surface_difference.h"
#include "optimizer/report/surface/surface_field.h"
#include "optimizer/report/surface/surface_filter.h"
#include "optimizer/report/surface/surface_ground.h"
#include "optimizer/report/surface/surface_passes.h"
#include "optimizer/report/surface/surface_preview.h"
#include "optimizer/report/surface/surface_studio.h"
#include "optimizer/report/surface/surface_tables.h"
#include "optimizer/report/surface/surface_view.h"
#include "optimizer/stages/validation/pipeline_choice.h"
#include "optimizer/stages/validation/pipeline_discrepancy.h"
#include "renderer/preview/studio_light.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { STREAM = 4000 };

static const char *const surface_name[] = {"flat", "cylinder", "drape", "mesh", "roll", "fold"};

/* One picture of the document. */
struct one_picture {
    size_t i;
    const char *entry_path;
    struct surface_method how;
    const struct surface_tables *tables;
    const struct surface_ground *ground; /* from render on, and the next */
    const struct appearance *model;      /* that is shown */
    struct surface_fit *fit;             /* made by render_picture */
};

static double paths_of(const struct job_surface_picture *p)
{
    return (double)p->px * (double)p->px * (double)p->sample * surface_sample_paths(p);
}

double surface_pictures_paths(const struct job_results *results)
{
    double n = surface_tables_paths(results);
    for (size_t i = 0; i < results->n_surface_picture; i++) n += paths_of(&results->surface_picture[i]);
    return n;
}

/* Returns the exposure that brings the mean of the lit pixels to a medium brightness. */
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

static json_t *rgb_json(const double rgb[3])
{
    return json_pack("[o, o, o]", json_number(rgb[0]), json_number(rgb[1]), json_number(rgb[2]));
}

/* Returns the root mean square of the pixels' standard errors over the mean brightness. *mean_rgb: mean radiance. */
static json_t *noise_json(const struct surface_passes *so_far, json_t **mean_rgb)
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
    *mean_rgb = rgb_json(mean);
    return json_number(brightness > 0.0 && so_far->n_sample > 1 ? sqrt(variance) / brightness : NAN);
}

static json_t *picture_json(const struct one_picture *one, const struct job_surface_picture *p,
                            const struct surface_passes *so_far, double exposure)
{
    char file[80];
    json_t *mean, *noise = noise_json(so_far, &mean);
    snprintf(file, sizeof file, "pictures/%s.exr", so_far->name);
    return json_pack("{s:s, s:s, s:s, s:s, s:I, s:o, s:o, s:o}", "file", file, "on", surface_name[p->on], "method",
                     picture_method_name[one->how.method], "model", one->model->id, "samples",
                     (json_int_t)so_far->n_sample, "mean", mean, "noise", noise, "png_exposure", json_number(exposure));
}

/* The path-traced picture beside one by tables, and how far they are apart. */
static json_t *reference_json(const struct surface_passes *picture, const struct surface_passes *reference)
{
    struct surface_difference d;
    char file[80];
    json_t *mean, *noise = noise_json(reference, &mean);
    surface_difference_of(&picture->image, &reference->image, &d);
    snprintf(file, sizeof file, "pictures/%s.exr", reference->name);
    return json_pack("{s:s, s:I, s:o, s:o, s:o, s:o, s:o, s:o}", "file", file, "samples",
                     (json_int_t)reference->n_sample, "mean", mean, "noise", noise, "mean_difference", rgb_json(d.mean),
                     "mean_difference_se", rgb_json(d.mean_se), "field_difference_rms", json_number(d.field_rms),
                     "field_noise", json_number(d.field_noise));
}

/* Means over the columns of the picture, as profiles across a cylinder are compared. */
static status write_columns(const struct report *report, const struct job_surface_picture *p,
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
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, relative, path);
    if (s == STATUS_OK) s = worker_folder_replace(report->in.job->tools->folder, path, text, n_byte, err);
    free(text);
    return s;
}

/* The picture so far as PNG; in the end also as EXR, and its columns. */
static status write_picture(struct report *report, const struct job_surface_picture *p,
                            const struct surface_passes *so_far, double exposure, struct error *err)
{
    bool whole = so_far->n_sample == p->sample;
    status s = result_image_write(report, &so_far->image, "pictures", so_far->name, exposure, whole, err);
    if (s == STATUS_OK && whole) s = result_thumbnail_of_image(report, &so_far->image, err);
    return s == STATUS_OK && whole ? write_columns(report, p, so_far, err) : s;
}

static status write_json(struct report *report, const char *path, const json_t *entry, struct error *err)
{
    char *text = entry != NULL ? json_dumps(entry, JSON_INDENT(1) | JSON_REAL_PRECISION(17)) : NULL;
    status s = text != NULL ? worker_folder_replace(report->in.job->tools->folder, path, text, strlen(text), err)
                            : error_set(err, STATUS_NO_MEMORY, "cannot write '%s': out of memory", path);
    free(text);
    return s;
}

/* A picture is filtered after the first pass, whenever its samples have doubled, and in the end. */
static bool is_filter_due(const struct job_surface_picture *p, const struct surface_passes *so_far)
{
    const size_t n = so_far->n_sample;
    return n == p->sample || (n & (n - 1)) == 0;
}

/* The same of the studio, which shows the filtered picture alone. */
static status write_studio(struct report *report, const struct one_picture *one, const struct surface_filter *filter,
                           const struct surface_passes *so_far, const struct surface_passes *shown,
                           struct surface_shown *how, struct error *err)
{
    const struct job_surface_picture *p = &report->in.results->surface_picture[one->i];
    const bool whole = so_far->n_sample == p->sample;
    status s = is_filter_due(p, so_far) ? surface_studio_write(report, one->i, filter, one->ground, so_far, how, err)
                                        : STATUS_OK;
    return s == STATUS_OK && whole ? result_exr_write(report, &shown->image, "pictures", so_far->name, err) : s;
}

/* The entry of result.json lies beside the picture and is written last: a picture is finished when its entry has all
 * samples. *out: the entry; the caller owns a reference to it. */
static status write_entry(struct report *report, const struct one_picture *one, const struct surface_filter *filter,
                          const struct surface_passes *so_far, json_t **out, struct error *err)
{
    const struct job_surface_picture *p = &report->in.results->surface_picture[one->i];
    struct surface_passes shown;
    status s = surface_ground_add(one->ground, so_far, &shown, err);
    if (s != STATUS_OK) return s;
    json_t *filtered = json_incref(json_object_get(*out, "filtered")); /* of an earlier pass */
    const bool studio = surface_studio_is(p);
    struct surface_shown how = {.exposure = studio ? studio_exposure(&so_far->image) : exposure_of(&shown.image),
                                .error = NAN};
    s = studio ? write_studio(report, one, filter, so_far, &shown, &how, err)
               : write_picture(report, p, &shown, how.exposure, err);
    if (s == STATUS_OK && !studio && is_filter_due(p, so_far)) {
        json_decref(filtered);
        s = surface_filter_write(report, filter, one->ground, so_far, how.exposure, &filtered, err);
    }
    if (s == STATUS_OK) {
        json_decref(*out);
        *out = picture_json(one, p, &shown, how.exposure);
    }
    surface_passes_release(&shown);
    if (s != STATUS_OK) {
        json_decref(filtered);
        return s;
    }
    if (studio) surface_studio_put(*out, p, filter, &how);
    if (one->how.method == JOB_PICTURE_FAST) surface_fit_put(*out, one->fit);
    if (p->speckle) json_object_set_new(*out, "speckle", json_true());
    if (one->ground->present) json_object_set_new(*out, "ground_z_mm", json_number(one->ground->z_mm));
    if (filtered != NULL) json_object_set_new(*out, "filtered", filtered);
    return write_json(report, one->entry_path, *out, err);
}

/* Renders pass by pass until all samples are there. */
static status render_picture(struct report *report, const struct one_picture *one, const struct render_request *q,
                             const struct progress *progress, struct surface_passes *so_far, json_t **entry,
                             struct error *err)
{
    struct surface_filter filter = {0};
    struct render_request by = *q;
    status s = surface_fit_make(report, &by, progress, one->fit, err);
    if (s == STATUS_OK) s = surface_filter_init(report, one->i, &by, one->tables, progress, &filter, err);
    while (s == STATUS_OK && so_far->n_sample < q->n_sample) {
        s = one->how.method == JOB_PICTURE_SHEARED
                ? surface_preview_render(report, one->i, one->how.look, &by, progress, so_far, err)
                : surface_passes_add(report, &by, progress, so_far, err);
        if (s == STATUS_OK) s = write_entry(report, one, &filter, so_far, entry, err);
    }
    if (s == STATUS_OK && *entry == NULL) s = write_entry(report, one, &filter, so_far, entry, err);
    surface_filter_release(&filter);
    return s;
}

/* The same view path by path, with random numbers of its own, and the comparison into the entry. */
static status render_reference(struct report *report, const struct one_picture *one, struct render_request q,
                               const struct progress *progress, const struct surface_passes *picture, json_t *entry,
                               struct error *err)
{
    char name[48];
    struct surface_passes traced;
    snprintf(name, sizeof name, "%s-reference", picture->name);
    q.input.fast = NULL;
    q.input.dual = NULL;
    q.input.diffusion = NULL;
    q.stream += JOB_MAX_SURFACE_PICTURE;
    status s = surface_passes_start(report, name, q.width, q.height, &traced, err);
    while (s == STATUS_OK && traced.n_sample < q.n_sample) s = surface_passes_add(report, &q, progress, &traced, err);
    struct surface_passes shown = {0}, shown_picture = {0};
    if (s == STATUS_OK) s = surface_ground_add(one->ground, &traced, &shown, err);
    if (s == STATUS_OK) s = surface_ground_add(one->ground, picture, &shown_picture, err);
    if (s == STATUS_OK)
        s = result_image_write(report, &shown.image, "pictures", name, exposure_of(&shown_picture.image), true, err);
    if (s == STATUS_OK) {
        json_object_set_new(entry, "reference", reference_json(picture, &traced));
        s = write_json(report, one->entry_path, entry, err);
    }
    surface_passes_release(&shown), surface_passes_release(&shown_picture), surface_passes_release(&traced);
    return s;
}

static status render(struct report *report, const struct one_picture *one, const struct progress *progress,
                     struct surface_passes *so_far, json_t **entry, struct error *err)
{
    const struct job_surface_picture *p = &report->in.results->surface_picture[one->i];
    const struct pipeline_model *model = &report->model[report_best_model(report)];
    bool traced = one->how.method == JOB_PICTURE_PATH, compared = p->reference && !traced;
    struct surface_cloth cloth;
    struct appearance far;
    const struct appearance *shown = surface_field_model(report, one->i, &model->setup->appearance, &far);
    struct surface_view view;
    const struct scene *fibers =
        model->setup->appearance.kind == MODEL_SURFACE ? made_cloth_scene(report->in.made, model->setup).fibers : NULL;
    status s = surface_view_init(report, one->i, &view, err);
    memset(&cloth, 0, sizeof cloth);
    if (s == STATUS_OK)
        s = surface_cloth_init(
            &(struct surface_input){report->in.job->tools, report->in.results, report->in.job->setup, report->in.made},
            one->i, fibers, &cloth, err);
    struct render_request q = {
        .input = {.scene = {.fibers = cloth.fibers, .volume = cloth.volume.bent != NULL ? &cloth.volume : NULL},
                  .model = shown,
                  .param = model->fit->result.param,
                  .n_set = model->setup->sets.n_set,
                  .discrepancy = traced ? pipeline_discrepancy(model->validation) : NULL,
                  .has_speckle = p->speckle,
                  .speckle_seed = report->in.job->seed},
        .configuration = &view.configuration,
        .width = p->px,
        .height = p->px,
        .n_sample = p->sample,
        .seed = report->in.job->seed ^ 0x73757266616365u,
        .stream = (uint32_t)(STREAM + one->i)};
    surface_method_apply(&one->how, &q.input);
    struct progress_part part;
    struct progress first = progress_begin_part(&part, progress, 0.0, compared ? 0.5 : 1.0);
    if (!traced && !surface_studio_is(p) && pipeline_discrepancy(model->validation) != NULL)
        worker_status_warn(report->in.job->tools->status,
                           "picture %zu is not path traced, and goes without the discrepancy", one->i + 1);
    struct surface_ground ground = {0};
    struct surface_fit fit;
    struct one_picture with = *one;
    with.fit = &fit;
    with.ground = &ground;
    with.model = shown;
    if (s == STATUS_OK) s = surface_ground_init(report, one->i, &q, &first, &ground, err);
    if (s == STATUS_OK) s = render_picture(report, &with, &q, &first, so_far, entry, err);
    first = progress_begin_part(&part, progress, 0.5, 0.5);
    if (s == STATUS_OK && compared) s = render_reference(report, &with, q, &first, so_far, *entry, err);
    surface_ground_release(&ground);
    surface_cloth_release(&cloth);
    surface_view_release(&view);
    return s == STATUS_OK || s == STATUS_CANCELLED ? s : error_prefix(err, s, "picture %zu", one->i + 1);
}

/* Returns whether an entry of an earlier attempt has all that the document asks for. */
static bool is_finished(const json_t *entry, const struct job_surface_picture *p, bool has_fibers)
{
    if (json_is_true(json_object_get(entry, "partial"))) return false;
    const char *method = json_string_value(json_object_get(entry, "method"));
    if (json_integer_value(json_object_get(entry, "samples")) != (json_int_t)p->sample) return false;
    if (p->filter && p->sample > 1 && !surface_studio_is(p) && has_fibers && json_object_get(entry, "filtered") == NULL)
        return false;
    return !p->reference || method == NULL || strcmp(method, picture_method_name[JOB_PICTURE_PATH]) == 0 ||
           json_object_get(entry, "reference") != NULL;
}

/* A picture without any light, which a camera that looks past the cloth and a lamp behind a black sheet make. */
static void warn_if_black(struct report *report, size_t i, const json_t *entry)
{
    const json_t *mean = json_object_get(entry, "mean");
    double sum = 0.0;
    for (size_t k = 0; k < json_array_size(mean); k++) sum += json_number_value(json_array_get(mean, k));
    if (sum == 0.0)
        worker_status_warn(report->in.job->tools->status,
                           "picture %zu is black: no light of the lamp comes from the cloth to the camera, or the "
                           "cloth lies beside the picture (see its angles, width_mm and black_sheet)",
                           i + 1);
}

static status write_one(struct report *report, size_t i, const struct surface_tables *tables,
                        const struct progress *progress, struct error *err)
{
    const struct job_surface_picture *p = &report->in.results->surface_picture[i];
    char name[32], relative[64], path[WORKER_PATH_BYTES];
    const bool has_fibers = report->model[report_best_model(report)].setup->appearance.kind == MODEL_SURFACE;
    struct surface_passes so_far;
    if (p->name != NULL)
        snprintf(name, sizeof name, "%s", p->name);
    else
        snprintf(name, sizeof name, "on-%zu", i + 1);
    snprintf(relative, sizeof relative, "pictures/%s.json", name);
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, relative, path);
    json_t *entry = json_load_file(path, 0, NULL);
    if (entry != NULL && is_finished(entry, p, has_fibers)) {
        warn_if_black(report, i, entry);
        return json_array_append_new(report->surface_pictures, entry) == 0 ? STATUS_OK : STATUS_NO_MEMORY;
    }
    json_decref(entry);
    entry = NULL;
    const struct one_picture one = {
        .i = i, .entry_path = path, .how = surface_tables_method(tables, p), .tables = tables};
    status s = surface_passes_start(report, name, p->px, p->px, &so_far, err);
    if (s == STATUS_OK) s = render(report, &one, progress, &so_far, &entry, err);
    if (s == STATUS_OK) {
        warn_if_black(report, i, entry);
        json_array_append_new(report->surface_pictures, entry);
    } else
        json_decref(entry);
    surface_passes_release(&so_far);
    return s;
}

status surface_pictures_write(struct report *report, double from, double to, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    double done = 0.0, all = surface_pictures_paths(report->in.results);
    if (report->in.results->n_surface_picture == 0) return STATUS_OK;
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, "pictures", path);
    status s = durable_make_folder(path, err);
    struct surface_tables tables = {0};
    double for_tables = (to - from) * surface_tables_paths(report->in.results) / all;
    struct progress_part making;
    struct progress make = progress_begin_part(&making, &report->in.job->tools->progress, from, for_tables);
    if (s == STATUS_OK) s = surface_tables_get(report, &make, &tables, err);
    const double whole = to - from;
    from += for_tables;
    for (size_t i = 0; i < report->in.results->n_surface_picture && s == STATUS_OK; i++) {
        const struct job_surface_picture *p = &report->in.results->surface_picture[i];
        double share = whole * paths_of(p) / all;
        struct progress_part part;
        struct progress progress = progress_begin_part(&part, &report->in.job->tools->progress, from + done, share);
        s = write_one(report, i, &tables, &progress, err);
        done += share;
    }
    surface_tables_release(&tables);
    return s;
}
