#include "base/files/durable.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/job/document/json_number.h"
#include "optimizer/photographs/camera/photograph_develop.h"
#include "optimizer/photographs/camera/photograph_process_load.h"
#include "optimizer/report/result/photograph_json.h"
#include "optimizer/tools/camera/camera_commands.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { FILES, CROP, TRANSFER, EXPOSURE, ISO, APERTURE, BLACK, OUT, JOB, JSON, N_OPTION };

/* Folders of a preview of a job: of its files, and of the pictures to write (NULL: none). */
struct preview {
    const char *folder, *pictures;
    bool begun;
    struct exposure_reference reference; /* once begun */
};

static void print_stated(const char *name, double value, const char *unit)
{
    if (isnan(value))
        printf("  %-14s not stated\n", name);
    else
        printf("  %-14s %.6g%s\n", name, value, unit);
}

static void print_mean(const char *name, const struct photograph_mean *m)
{
    const struct photograph_record *r = &m->record;
    printf("%s\n  %-14s %s, %u bit%s%s%s\n", name, "read as", r->info.format, r->info.bits,
           r->info.curve_of_file ? ", curve of the file"
           : r->info.encoded     ? ", curve as declared"
                                 : ", linear",
           r->info.camera[0] != '\0' ? ", " : "", r->info.camera);
    printf("  %-14s %zu x %zu pixels\n", "size", r->width, r->height);
    print_stated("black level", r->info.black_level, " subtracted");
    print_stated("exposure", r->info.exposure_s, " s");
    print_stated("ISO", r->info.iso, "");
    print_stated("f-number", r->info.aperture, "");
    printf("  %-14s %.6g (pixel values are divided by it)%s\n", "exposure value", r->exposure,
           r->n_exposure > 1 ? ", merged" : "");
    printf("  %-14s %.6g %.6g %.6g\n", "mean rgb", m->mean_rgb[0], m->mean_rgb[1], m->mean_rgb[2]);
    printf("  %-14s %.2g %.2g %.2g\n", "standard error", m->se_rgb[0], m->se_rgb[1], m->se_rgb[2]);
    if (r->merged && !isnan(r->noise_se_rgb[0]))
        printf("  %-14s %.2g %.2g %.2g\n", "camera's noise", r->noise_se_rgb[0], r->noise_se_rgb[1],
               r->noise_se_rgb[2]);
    for (size_t i = 0; i < r->n_exposure && r->n_exposure > 1; i++)
        printf("  %-14s %.6g s\n", i == 0 ? "fitted times" : "", r->fitted_s[i]);
    printf("  %-14s %.2f %%\n", "saturated", 100.0 * r->saturated_share);
    printf("  %-14s means of parts scatter by %.1f %%\n", "uniformity", 100.0 * m->block_contrast);
    if (r->info.less_trustworthy) printf("  %-14s 8 bits, or a camera's own processing: less trustworthy\n", "warning");
    if (m->warning[0] != '\0') printf("  %-14s %s\n", "warning", m->warning);
    if (r->exposure_warning[0] != '\0') printf("  %-14s %s\n", "warning", r->exposure_warning);
    for (size_t i = 0; i < r->info.ledger.n; i++) {
        const struct file_statement *f = &r->info.ledger.item[i];
        printf("  %-14s %s %s: %s%s\n", i == 0 ? "the file states" : "", f->name, f->value,
               f->use == FILE_STATEMENT_APPLIED ? "applied" : "not used, ", f->reason);
    }
}

/* Draws the crop of p in the whole picture of the file at `path`. */
static status write_picture(const char *path, const struct job_photograph *p, const char *out, struct error *err)
{
    struct job_photograph whole = *p;
    struct image im;
    memset(whole.crop_px, 0, sizeof whole.crop_px);
    status s = photograph_read(path, &whole, &im, NULL, err);
    if (s == STATUS_OK) s = camera_write_picture(&im, p->crop_px, out, err);
    image_release(&im);
    return s;
}

static status read_number(const char *word, double lower, double *out, struct error *err)
{
    char *end;
    *out = strtod(word, &end);
    if (end != word && *end == '\0' && isfinite(*out) && *out >= lower && *out < 1e9) return STATUS_OK;
    return error_set(err, STATUS_INVALID, "'%s' is no number that is allowed here", word);
}

static status photograph_of_options(const struct camera_option *o, struct job_photograph *p, struct error *err)
{
    unsigned transfer = 0;
    status s = camera_option_transfer(&o[TRANSFER], &transfer, err);
    *p = photograph_plain((enum job_transfer)transfer);
    if (s == STATUS_OK) s = camera_option_number(&o[EXPOSURE], &p->exposure_s, err);
    if (s == STATUS_OK) s = camera_option_number(&o[ISO], &p->iso, err);
    if (s == STATUS_OK) s = camera_option_number(&o[APERTURE], &p->aperture, err);
    if (s == STATUS_OK && o[BLACK].n > 0) s = read_number(o[BLACK].word[0], -1e9, &p->black_level, err);
    for (size_t i = 0; i < 4 && s == STATUS_OK && o[CROP].n > 0; i++) {
        double at = 0.0;
        s = read_number(o[CROP].word[i], 0.0, &at, err);
        p->crop_px[i] = (size_t)at;
    }
    if (s == STATUS_OK && o[CROP].n > 0 && (p->crop_px[2] <= p->crop_px[0] || p->crop_px[3] <= p->crop_px[1]))
        s = error_set(err, STATUS_INVALID, "--crop-px is empty: the order is x0 y0 x1 y1");
    if (s == STATUS_OK && o[OUT].n > 0 && o[FILES].n > 1)
        s = error_set(err, STATUS_INVALID, "--out goes with one photograph");
    if (s == STATUS_OK && (o[FILES].n > 0) == (o[JOB].n > 0))
        s = error_set(err, STATUS_INVALID, "give photographs, or --job with a job document");
    return s;
}

static int preview_files(const struct camera_option *o, const struct job_photograph *p)
{
    int exit_code = 0;
    for (size_t i = 0; i < o[FILES].n; i++) {
        struct photograph_mean mean = {0};
        struct error err = {0};
        status s = photograph_measure(o[FILES].word[i], p, &mean, &err);
        if (mean.record.info.format != NULL) print_mean(path_file_name(o[FILES].word[i]), &mean);
        if (s == STATUS_OK && o[OUT].n > 0) s = write_picture(o[FILES].word[i], p, o[OUT].word[0], &err);
        if (s == STATUS_OK) continue;
        fprintf(stderr, "error: %s\n", err.text);
        exit_code = 1;
    }
    return exit_code;
}

static void print_warning(void *context, const char *option, const char *text)
{
    (void)context;
    (void)option;
    printf("warning: %s\n", text);
}

static void print_color(const struct photograph_process *k)
{
    if (!k->has_color) return;
    printf("colors\n");
    for (size_t i = 0; i < 3; i++)
        printf("  %-14s %10.4g %10.4g %10.4g\n", i == 0 ? "matrix" : "", k->matrix[3 * i], k->matrix[3 * i + 1],
               k->matrix[3 * i + 2]);
    if (k->chart_picture.pixel == NULL) return;
    const struct color_chart *c = &k->chart;
    printf("  %-14s %s; CIEDE2000 %.2f before, %.2f after the matrix%s\n", "chart",
           c->found_automatically ? "found" : "at the corners given", color_chart_mean(c->delta_e_before),
           color_chart_mean(c->delta_e_after), c->matrix_used ? "" : " (not used: one factor for all channels)");
    printf("  %-14s %.2f; the worst patch is '%s', %.2f\n", "left out", color_chart_mean(c->delta_e_left_out),
           color_chart_patch_name(c->worst), c->delta_e_left_out[c->worst]);
    printf("  %-14s varies by %.1f %% over the chart; the scale holds %s\n", "lamp's light", 100.0 * c->light_range,
           isnan(c->scale_at_px[0]) ? "in its middle" : "at 'cloth_px'");
}

/* A row of the JSON file: the values that a job would take from a photograph. */
static json_t *row_json(const struct job_photograph *p, const struct photograph_mean *m)
{
    json_t *color = json_array();
    for (size_t c = 0; c < 3; c++)
        json_array_append_new(color, json_number_list(m->record.color_error[c], PHOTOGRAPH_CAUSES, 1.0));
    json_t *row =
        json_pack("{s:s, s:o, s:o, s:o, s:[i,i,i,i], s:o, s:o, s:o}", "file", p->file, "mean_rgb",
                  json_number_list(m->mean_rgb, 3, 1.0), "standard_error", json_number_list(m->se_rgb, 3, 1.0),
                  "color_error", color, "crop_px", (int)p->crop_px[0], (int)p->crop_px[1], (int)p->crop_px[2],
                  (int)p->crop_px[3], "camera_theta_deg", json_number(p->camera_theta_deg), "camera_phi_deg",
                  json_number(p->camera_phi_deg), "photograph", photograph_record_json(&m->record));
    if (p->column.number > 0) json_object_set_new(row, "column", photograph_column_json(p->file, &p->column));
    return row;
}

/* Draws the crop of p, or all columns that begin with it, in the whole picture, as it is developed, into the folder
 * `pictures`. */
static status write_developed(const struct photograph_process *k, const char *folder, const struct job_photograph *p,
                              const char *pictures, struct error *err)
{
    struct job_photograph whole = *p;
    struct image im;
    char path[4096];
    memset(whole.crop_px, 0, sizeof whole.crop_px);
    memset(whole.crop_exact_px, 0, sizeof whole.crop_exact_px);
    whole.column.number = 0;
    status s = photograph_develop(k, folder, &whole, &im, NULL, err);
    if (s != STATUS_OK) return s;
    snprintf(path, sizeof path, "%s/%s.png", pictures, p->file);
    s = p->column.number > 0 ? camera_write_columns(&im, p, p->column.n, path, err)
                             : camera_write_picture(&im, p->crop_px, path, err);
    image_release(&im);
    return s;
}

/* Makes the folder and writes the picture of the chart into it, if there is one. */
static status begin_pictures(const struct photograph_process *k, const char *pictures, struct error *err)
{
    char path[4096];
    if (mkdir(pictures, 0777) != 0 && errno != EEXIST)
        return error_set_errno(err, "cannot make the folder '%s' for pictures", pictures);
    if (k->chart_picture.pixel == NULL) return STATUS_OK;
    snprintf(path, sizeof path, "%s/color-chart.png", pictures);
    return image_write_png(&k->chart_picture, 1.0, path, err);
}

/* Prints the photographs of the document and appends them to `rows`. A photograph that cannot be used is drawn as well,
 * because the picture may show why. */
static status preview_photograph(const struct photograph_process *k, struct preview *v, const struct job_photograph *p,
                                 json_t *rows)
{
    const char *const folder = v->folder;
    struct photograph_mean mean = {0};
    struct error err = {0};
    struct image im;
    char name[JOB_MAX_NAME_BYTES];
    job_photograph_name(p, name);
    status s = photograph_develop(k, folder, p, &im, &mean.record, &err);
    if (s == STATUS_OK) {
        s = photograph_measure_image(&im, name, p->transfer, &mean, &err);
        image_release(&im);
    }
    if (s == STATUS_OK) {
        if (!v->begun) v->reference = photograph_process_reference(k, &mean.record);
        v->begun = true;
        exposure_rounding_state(&mean.record, &v->reference, mean.mean_rgb, mean.se_rgb);
    }
    if (mean.record.info.format != NULL) print_mean(name, &mean);
    if (s == STATUS_OK) json_array_append_new(rows, row_json(p, &mean));
    if (s != STATUS_OK) fprintf(stderr, "error: %s\n", err.text);
    struct error picture_err = {0};
    if (v->pictures == NULL || p->column.number > 1 ||
        write_developed(k, folder, p, v->pictures, &picture_err) == STATUS_OK)
        return s;
    if (s == STATUS_OK) fprintf(stderr, "error: %s\n", picture_err.text);
    return STATUS_INVALID;
}

static int preview_job(const char *path, const char *json_path, const char *pictures)
{
    struct camera_job job;
    struct preview view = {.folder = job.folder, .pictures = pictures};
    struct photograph_process process;
    struct error err = {0};
    json_t *rows = json_array();
    bool whole = true;
    const struct warning_sink warn = {print_warning, NULL};
    photograph_process_init(&process);
    process.warn = &warn;
    status s = camera_job_read(path, &job, &err);
    if (s == STATUS_OK) s = photograph_process_load(&process, job.setup, job.rows, job.folder, &err);
    if (s == STATUS_OK) print_color(&process);
    if (s == STATUS_OK && pictures != NULL) s = begin_pictures(&process, pictures, &err);
    for (size_t i = 0; s == STATUS_OK && i < job.rows->n_photograph; i++)
        whole = preview_photograph(&process, &view, &job.rows->photograph[i], rows) == STATUS_OK && whole;
    if (s == STATUS_OK && json_path != NULL && json_dump_file(rows, json_path, JSON_INDENT(1)) != 0)
        s = error_set(&err, STATUS_IO, "cannot write '%s'", json_path);
    if (s != STATUS_OK) fprintf(stderr, "error: %s\n", err.text);
    photograph_process_release(&process);
    camera_job_release(&job);
    json_decref(rows);
    return s == STATUS_OK && whole ? 0 : 1;
}

int camera_command_photo(int argc, char **argv)
{
    struct camera_option o[N_OPTION] = {
        [FILES] = {"", 0, 10000, NULL, 0},        [CROP] = {"crop-px", 0, 4, NULL, 0},
        [TRANSFER] = {"transfer", 0, 1, NULL, 0}, [EXPOSURE] = {"exposure-s", 0, 1, NULL, 0},
        [ISO] = {"iso", 0, 1, NULL, 0},           [APERTURE] = {"aperture", 0, 1, NULL, 0},
        [BLACK] = {"black-level", 0, 1, NULL, 0}, [OUT] = {"out", 0, 1, NULL, 0},
        [JOB] = {"job", 0, 1, NULL, 0},           [JSON] = {"json", 0, 1, NULL, 0}};
    struct error err = {0};
    struct job_photograph p;
    status s = camera_options_parse(argc, argv, o, N_OPTION, &err);
    if (s == STATUS_OK && o[CROP].n % 4 != 0) s = error_set(&err, STATUS_INVALID, "--crop-px takes four numbers");
    if (s == STATUS_OK) s = photograph_of_options(o, &p, &err);
    if (s != STATUS_OK) {
        fprintf(stderr, "error: %s; `selvedge photo --help` lists the options\n", err.text);
        return 2;
    }
    if (o[JOB].n == 0) return preview_files(o, &p);
    return preview_job(o[JOB].word[0], o[JSON].n > 0 ? o[JSON].word[0] : NULL, o[OUT].n > 0 ? o[OUT].word[0] : NULL);
}
