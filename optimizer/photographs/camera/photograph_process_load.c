#include "optimizer/photographs/camera/photograph_process_load.h"

#include "base/angle.h"
#include "base/option_id.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/photographs/camera/column_views.h"
#include "optimizer/photographs/camera/cylinder_columns.h"
#include "optimizer/photographs/camera/marker_views.h"
#include "optimizer/photographs/camera/photograph_develop.h"
#include "optimizer/photographs/camera/rig.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PATH_BYTES = 4096 };

/* ---- color ---- */

/* Value from which on a developed sample was saturated. */
static double saturation_of(const struct photograph_record *r)
{
    return 0.999999 * photograph_saturation(&r->info) / r->exposure;
}

static status read_reference(const struct job_setup *setup, const char *folder, double rgb[COLOR_CHART_PATCHES][3],
                             struct error *err)
{
    char path[PATH_BYTES];
    if (setup->chart_reference_file[0] == '\0') return STATUS_OK;
    snprintf(path, sizeof path, "%s/%s", folder, setup->chart_reference_file);
    return color_chart_reference_read(path, rgb, err);
}

static status load_chart(struct photograph_process *k, const struct job_setup *setup, const char *folder,
                         struct error *err)
{
    struct image im;
    struct photograph_record r;
    double reference[COLOR_CHART_PATCHES][3];
    status s = read_reference(setup, folder, reference, err);
    if (s == STATUS_OK) s = photograph_develop(k, folder, &setup->chart, &im, &r, err);
    if (s != STATUS_OK) return s;
    memcpy(k->chart.corner_px, setup->chart_corner_px, sizeof k->chart.corner_px);
    memcpy(k->chart.scale_at_px, setup->chart_cloth_px, sizeof k->chart.scale_at_px);
    k->chart.from_2014 = setup->chart_from_2014;
    k->chart.reference = setup->chart_reference_file[0] != '\0' ? (const double(*)[3])reference : NULL;
    s = color_chart_find(&im, k->chart.corner_px, &k->chart.found_automatically, err);
    if (s == STATUS_NOT_FOUND)
        s = error_set(err, STATUS_INVALID, "no chart was found: give the corners of its patches ('corners_px')");
    if (s == STATUS_OK)
        s = color_chart_measure(&k->chart, &im, saturation_of(&r), setup->chart.light_theta_deg * RAD_PER_DEG, k->warn,
                                err);
    if (s == STATUS_OK) s = color_chart_picture(&k->chart, &im, &k->chart_picture, err);
    k->chart.reference = NULL;
    image_release(&im);
    if (s != STATUS_OK) return error_prefix(err, s, "cannot use color chart '%s'", setup->chart.file);
    memcpy(k->matrix, k->chart.fit.matrix, sizeof k->matrix);
    memcpy(k->matrix_cov, k->chart.fit.cov, sizeof k->matrix_cov);
    k->color_info = r.info;
    k->color_exposure = (struct exposure_reference){r.scale_s, r.info.aperture, r.info.iso};
    return STATUS_OK;
}

/* A factor for each channel. */
static status load_white(struct photograph_process *k, const struct job_setup *setup, const char *folder,
                         struct error *err)
{
    struct image im;
    struct photograph_mean mean = {0};
    status s = photograph_develop(k, folder, &setup->white, &im, &mean.record, err);
    if (s != STATUS_OK) return s;
    s = photograph_measure_image(&im, setup->white.file, setup->white.transfer, &mean, err);
    image_release(&im);
    double cos_theta = cos(setup->white.light_theta_deg * RAD_PER_DEG);
    for (size_t c = 0; c < 3 && s == STATUS_OK; c++) {
        if (!(mean.mean_rgb[c] > 0.0))
            return error_set(err, STATUS_INVALID, "cannot use white reference '%s': it is black in a channel",
                             setup->white.file);
        k->matrix[4 * c] = setup->white_reflectance[c] * cos_theta / mean.mean_rgb[c];
        k->matrix_cov[4 * c * 10] = pow(k->matrix[4 * c] * mean.se_rgb[c] / mean.mean_rgb[c], 2.0);
    }
    k->color_info = mean.record.info;
    k->color_exposure =
        (struct exposure_reference){mean.record.scale_s, mean.record.info.aperture, mean.record.info.iso};
    return s;
}

static status load_color(struct photograph_process *k, const struct job_setup *setup, const char *folder,
                         struct error *err)
{
    if (!setup->has_color) return STATUS_OK;
    status s = setup->has_chart ? load_chart(k, setup, folder, err) : load_white(k, setup, folder, err);
    k->has_color = s == STATUS_OK;
    if (s != STATUS_OK && err != NULL)
        snprintf(err->field, sizeof err->field, setup->has_chart ? OPTION_COLOR_CHART : OPTION_COLOR_WHITE);
    return s;
}

status photograph_process_load(struct photograph_process *k, struct job_setup *setup, struct job_rows *rows,
                               const char *folder, struct error *err)
{
    char path[PATH_BYTES];
    status s = STATUS_OK;
    if (setup->rig_file[0] != '\0') {
        snprintf(path, sizeof path, "%s/%s", folder, setup->rig_file);
        s = rig_apply(path, setup, rows, &k->lens, &k->board, err);
        if (s == STATUS_OK) s = marker_views_apply(&k->board, &k->lens, folder, setup, rows, err);
    }
    k->rows = rows;
    if (s == STATUS_OK && k->carry == NULL) k->carry = calloc(1, sizeof *k->carry);
    if (s == STATUS_OK && k->columns == NULL) k->columns = calloc(1, sizeof *k->columns);
    k->lamp_distance_cm = setup->lamp_directional ? NAN : setup->lamp_distance_cm;
    if (s == STATUS_OK && setup->noise_file[0] != '\0') {
        snprintf(path, sizeof path, "%s/%s", folder, setup->noise_file);
        s = noise_record_read(path, &k->noise, err);
        k->has_noise = s == STATUS_OK;
        if (s != STATUS_OK && err != NULL) snprintf(err->field, sizeof err->field, OPTION_CAMERA_NOISE);
    }
    if (s == STATUS_OK) s = photograph_process_load_dark(k, setup, rows, folder, err);
    if (s == STATUS_OK) s = load_color(k, setup, folder, err);
    return s == STATUS_OK ? cylinder_columns_make(k, setup, rows, folder, err) : s;
}
