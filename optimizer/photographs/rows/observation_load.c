#include "optimizer/photographs/rows/observation_load.h"
#include "base/files/durable.h"
#include "base/option_id.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/photographs/camera/column_views.h"
#include "optimizer/photographs/reader/photograph.h"
#include "optimizer/photographs/reader/photograph_contrast.h"
#include "optimizer/photographs/rows/brdf_file.h"
#include "optimizer/photographs/rows/column_errors.h"
#include "optimizer/photographs/rows/measurement_table.h"

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_TABLE_BYTES = 16 << 20 };

static status load_table(const struct job_setup *setup, const struct job_rows *rows, const char *folder,
                         const struct warning_sink *warn, struct observation_set *o, struct error *err)
{
    char path[4096];
    char *text = NULL;
    size_t n = 0;
    const brdf_reader *reader = brdf_reader_of_name(rows->measurement_file);
    snprintf(path, sizeof path, "%s/%s", folder, rows->measurement_file);
    if (reader != NULL) return brdf_file_read(reader, path, setup, rows, warn, o, err);
    if (rows->n_measured_row > 0 || rows->measurement_symmetry != JOB_SYMMETRY_FILE)
        return error_set_field(
            err, STATUS_INVALID, OPTION_MEASURED_ROWS,
            "configurations and symmetry are those of a measured BRDF, but '%s' is a table: its rows "
            "say which",
            rows->measurement_file);
    status s = file_read_all(path, MAX_TABLE_BYTES, &text, &n, err);
    if (s != STATUS_OK) {
        if (err != NULL) snprintf(err->field, sizeof err->field, OPTION_MEASUREMENT_FILE);
        return s;
    }
    s = measurement_table_parse(text, n, rows->measurement_file, setup, o, err);
    free(text);
    return s;
}

static status measure_texture(const struct job_setup *setup, const struct job_fit *fit, const struct image *im,
                              struct observation *item, const struct warning_sink *warn, struct error *err)
{
    item->n_cell = job_texture_cells(setup->crop_cm, fit->texture_block_mm);
    status s = photograph_contrast(im, item->name, item->n_cell, item->contrast_rgb, item->contrast_se_rgb, err);
    if (s != STATUS_OK) {
        if (err != NULL) snprintf(err->field, sizeof err->field, OPTION_TEXTURE_BLOCK);
        return s;
    }
    if (!observation_contrast_known(item) && fit->texture_weight > 0.0)
        warning_send(
            warn, OPTION_NONE,
            "photograph '%s' is black in one of its channels, so its texture is not compared with the rendering's",
            item->name);
    return STATUS_OK;
}

/* Shared by all photographs of a job. */
struct series {
    const struct job_setup *setup;
    const struct job_fit *fit;
    const char *folder;
    const struct photograph_process *process;
    const struct warning_sink *warn;
    size_t first; /* observation of the first photograph */
};

static status load_photograph(const struct series *all, const struct job_photograph *p, struct observation_set *o,
                              struct error *err)
{
    struct photograph_mean mean = {0};
    struct observation item = {.set = p->set, .weight = p->weight};
    struct image im;
    job_photograph_name(p, item.name);
    status s = photograph_develop(all->process, all->folder, p, &im, &mean.record, err);
    if (s == STATUS_OK) {
        s = photograph_measure_image(&im, item.name, p->transfer, &mean, err);
        if (s != STATUS_OK) image_release(&im);
    }
    if (s != STATUS_OK) {
        if (err != NULL) snprintf(err->field, sizeof err->field, OPTION_PHOTOGRAPH_FILE "[%zu]", p->index);
        return s;
    }
    const char *const warning[2] = {mean.warning, mean.record.exposure_warning};
    for (size_t k = 0; k < 2; k++)
        if (warning[k][0] != '\0') warning_send(all->warn, OPTION_NONE, "%s", warning[k]);
    if (all->fit->texture_block_mm > 0.0 && p->column.number == 0)
        s = measure_texture(all->setup, all->fit, &im, &item, all->warn, err);
    image_release(&im);
    if (s != STATUS_OK) return s;
    const struct exposure_reference reference =
        photograph_process_reference(all->process, o->n > all->first ? &o->item[all->first].photograph : &mean.record);
    exposure_rounding_state(&mean.record, &reference, mean.mean_rgb, mean.se_rgb);
    item.photograph = mean.record;
    memcpy(item.mean_rgb, mean.mean_rgb, sizeof item.mean_rgb);
    memcpy(item.se_rgb, mean.se_rgb, sizeof item.se_rgb);
    item.configuration = observation_configuration(all->setup, p->light_theta_deg, p->light_phi_deg,
                                                   p->camera_theta_deg, p->camera_phi_deg, p->cloth_rotation_deg);
    if (p->light_distance_cm > 0.0) item.configuration.light_distance_m = 0.01 * p->light_distance_cm;
    item.column = p->column;
    if (p->camera_distance_cm > 0.0) item.configuration.camera_distance_m = 0.01 * p->camera_distance_cm;
    return observation_set_append(o, &item, err);
}

/* Either all photographs state a factor of the exposure or none does: otherwise their values have no common scale. */
static status check_exposures(const struct observation_set *o, size_t first, const struct photograph_process *process,
                              struct error *err)
{
    static const struct {
        const char *name, *key;
        size_t at;
    } factor[] = {{"exposure time", "exposure_s", offsetof(struct photograph_info, exposure_s)},
                  {"ISO value", "iso", offsetof(struct photograph_info, iso)},
                  {"f-number", "aperture", offsetof(struct photograph_info, aperture)}};
    for (size_t k = 0; k < sizeof factor / sizeof *factor; k++) {
        size_t with = SIZE_MAX, without = SIZE_MAX;
        for (size_t i = o->n; i-- > first;) {
            double value;
            memcpy(&value, (const char *)&o->item[i].photograph.info + factor[k].at, sizeof value);
            *(isnan(value) ? &without : &with) = i;
        }
        double of_color;
        memcpy(&of_color, (const char *)&process->color_info + factor[k].at, sizeof of_color);
        if (process->has_color && isnan(of_color) != (with == SIZE_MAX) && o->n > first)
            return error_set_field(err, STATUS_INVALID, OPTION_COLOR_CHART,
                                   "the %s of the photographs is %s, that of the color chart or white reference is %s, "
                                   "so their values have no common scale: write '%s' beside it",
                                   factor[k].name, with == SIZE_MAX ? "not known" : "known",
                                   isnan(of_color) ? "not" : "known", factor[k].key);
        if (with == SIZE_MAX || without == SIZE_MAX) continue;
        char field[sizeof err->field];
        snprintf(field, sizeof field, OPTION_PHOTOGRAPH_FILE "[%zu]", without - first);
        return error_set_field(err, STATUS_INVALID, field,
                               "cannot use photograph '%s': its %s is not known, but that of '%s' is, so their values "
                               "have no common scale: write '%s' beside it",
                               o->item[without].name, factor[k].name, o->item[with].name, factor[k].key);
    }
    return STATUS_OK;
}

static bool is_processed(const struct photograph_info *info) { return info->less_trustworthy; }
static bool is_balanced(const struct photograph_info *info) { return info->less_trustworthy && info->auto_balance; }

/* Counts the photographs for which `is` holds; *which: the first. */
static size_t count_photographs(const struct observation_set *o, size_t first,
                                bool (*is)(const struct photograph_info *info), size_t *which)
{
    size_t n = 0;
    for (size_t i = o->n; i-- > first;)
        if (is(&o->item[i].photograph.info)) {
            n++;
            *which = i;
        }
    return n;
}

static void warn_less_trustworthy(const struct observation_set *o, size_t first, const struct warning_sink *warn)
{
    size_t which = 0, n = count_photographs(o, first, is_processed, &which);
    if (n > 0)
        warning_send(warn, OPTION_PHOTOGRAPHS,
                     "%zu of %zu photographs ('%s'%s) have 8 bits, or the curve of a camera's own processing: trust "
                     "the fitted values less than those of raw files or OpenEXR",
                     n, o->n - first, o->item[which].name, n > 1 ? " and others" : "");
    n = count_photographs(o, first, is_balanced, &which);
    if (n > 0)
        warning_send(warn, OPTION_PHOTOGRAPHS,
                     "%zu of %zu photographs ('%s'%s) state an automatic white balance, which may have given each "
                     "picture other colors: set the balance by hand, or give the raw files",
                     n, o->n - first, o->item[which].name, n > 1 ? " and others" : "");
}

status observation_set_load(const struct job_setup *setup, const struct job_rows *rows, const struct job_fit *fit,
                            const char *folder, const struct photograph_process *process,
                            const struct warning_sink *warn, struct observation_set *o, struct error *err)
{
    const struct photograph_process nothing = {0};
    if (process == NULL) process = &nothing;
    if (rows->measurement_file[0] != '\0') return load_table(setup, rows, folder, warn, o, err);
    const size_t first = o->n;
    const struct series all = {setup, fit, folder, process, warn, first};
    for (size_t i = 0; i < rows->n_photograph; i++) {
        status s = load_photograph(&all, &rows->photograph[i], o, err);
        if (s != STATUS_OK) return s;
    }
    if (process->columns != NULL) column_views_release(process->columns); /* a fit follows, which wants the memory */
    column_errors_state(o, first);
    warn_less_trustworthy(o, first, warn);
    return check_exposures(o, first, process, err);
}
