#include "optimizer/photographs/camera/photograph_develop.h"

#include "base/angle.h"
#include "base/option_id.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/photographs/camera/color_matrix.h"
#include "optimizer/photographs/camera/marker_views.h"
#include "optimizer/photographs/camera/rig.h"
#include "optimizer/photographs/camera/view_exposures.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PATH_BYTES = 4096 };

/* Standard error of the mean over a picture whose pixels have these variances. */
static void mean_error(const struct image *variance, double se_rgb[3])
{
    const size_t n = variance->width * variance->height;
    double sum[3] = {0};
    for (size_t i = 0; i < 3 * n; i++) sum[i % 3] += (double)variance->pixel[i];
    for (size_t c = 0; c < 3; c++) se_rgb[c] = n > 0 ? sqrt(sum[c]) / (double)n : NAN;
}

/* Applies the matrix to the picture, to the error of its mean by the camera's noise, and adds the error of the mean by
 * the errors of the matrix. */
static void apply_color(const struct photograph_process *k, struct image *im, struct photograph_record *r)
{
    const size_t n = im->width * im->height;
    double out[3] = {0}, mean[3] = {0};
    for (size_t i = 0; i < 3 * n; i++) mean[i % 3] += (double)im->pixel[i] / (double)n;
    double error[3][COLOR_MATRIX_CAUSES];
    color_matrix_error(k->matrix_cov, mean, error);
    for (size_t c = 0; c < 3; c++) memcpy(r->color_error[c], error[c], sizeof error[c]);
    color_matrix_apply_image(k->matrix, im);
    for (size_t c = 0; c < 9; c++)
        out[c / 3] += k->matrix[c] * k->matrix[c] * r->noise_se_rgb[c % 3] * r->noise_se_rgb[c % 3];
    for (size_t c = 0; c < 3; c++) r->noise_se_rgb[c] = sqrt(out[c]);
}

/* Adds the error of the mean radiance by the errors of the fitted times. */
static void add_time_error(const struct photograph_process *k, const struct view_exposures *e,
                           struct photograph_record *r)
{
    for (size_t i = 0; i < e->n; i++) {
        double error[3] = {e->time_error[i][0], e->time_error[i][1], e->time_error[i][2]};
        if (k->has_color) color_matrix_apply(k->matrix, error, error);
        for (size_t c = 0; c < 3; c++) r->exposure_se_rgb[c] = hypot(r->exposure_se_rgb[c], error[c]);
    }
}

/* A lamp at twice the distance gives a quarter of the light, and radiances are relative to the light that there is. */
static double distance_factor(const struct photograph_process *k, const struct job_photograph *p)
{
    double ratio = p->light_distance_cm / k->lamp_distance_cm;
    return ratio > 0.0 ? ratio * ratio : 1.0;
}

/* Share of the crop's pixels, in the picture before the correction of the lens, that are saturated in all exposures.
 * Those have at least the value of full scale in the shortest one. */
static double saturated_in_crop(const struct view_exposures *e, const size_t crop[4])
{
    const struct image *im = &e->image[0];
    const struct photograph_info *info = &e->record[0].info;
    size_t x1 = crop[2] > 0 ? crop[2] : im->width, y1 = crop[3] > 0 ? crop[3] : im->height, n = 0;
    double shortest_s = e->record[0].fitted_s[0];
    for (size_t i = 1; i < e->n; i++) shortest_s = fmin(shortest_s, e->record[0].fitted_s[i]);
    const double level = photograph_saturation(info);
    const float limit = (float)(e->n > 1 ? 0.999999 * level * info->exposure_s / shortest_s : level);
    if (!isfinite(level) || x1 > im->width || y1 > im->height) return 0.0;
    for (size_t y = crop[1]; y < y1; y++)
        for (size_t x = crop[0]; x < x1; x++) {
            const float *p = im->pixel + 3 * (y * im->width + x);
            n += fmaxf(p[0], fmaxf(p[1], p[2])) >= limit;
        }
    return (double)n / (double)((x1 - crop[0]) * (y1 - crop[1]));
}

static status correct_lens(const struct photograph_process *k, const struct job_photograph *p, struct view_exposures *e,
                           struct error *err)
{
    double crop[4];
    for (size_t i = 0; i < 4; i++) crop[i] = p->crop_exact_px[2] > 0.0 ? p->crop_exact_px[i] : (double)p->crop_px[i];
    e->record[0].saturated_share = saturated_in_crop(e, p->crop_px);
    status s = lens_correct(&k->lens, crop, &e->image[0], err);
    if (s == STATUS_OK && e->variance.pixel != NULL) s = lens_correct_variance(&k->lens, crop, &e->variance, err);
    return s == STATUS_OK ? s : error_prefix(err, s, "cannot use photograph '%s'", p->file);
}

status photograph_develop(const struct photograph_process *k, const char *folder, const struct job_photograph *p,
                          struct image *im, struct photograph_record *record, struct error *err)
{
    struct view_exposures *e = calloc(1, sizeof *e);
    if (e == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read photograph '%s': out of memory", p->file);
    memset(im, 0, sizeof *im);
    status s = view_exposures_read(k, folder, p, e, err);
    if (s == STATUS_OK && photograph_process_has_lens(k)) s = correct_lens(k, p, e, err);
    if (s == STATUS_OK) {
        struct photograph_record *r = &e->record[0];
        const double factor = p->scale / r->exposure * distance_factor(k, p);
        mean_error(&e->variance, r->noise_se_rgb);
        if (k->has_color) apply_color(k, &e->image[0], r);
        add_time_error(k, e, r);
        image_scale(&e->image[0], factor);
        for (size_t c = 0; c < 3; c++) {
            r->noise_se_rgb[c] *= factor;
            r->exposure_se_rgb[c] *= factor;
            for (size_t cause = 0; cause < PHOTOGRAPH_CAUSES; cause++) r->color_error[c][cause] *= factor;
        }
        *im = e->image[0];
        e->image[0] = (struct image){0};
        if (record != NULL) *record = *r;
    }
    view_exposures_release(e);
    free(e);
    return s;
}

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
    k->lamp_distance_cm = setup->lamp_directional ? NAN : setup->lamp_distance_cm;
    if (s == STATUS_OK && setup->noise_file[0] != '\0') {
        snprintf(path, sizeof path, "%s/%s", folder, setup->noise_file);
        s = noise_record_read(path, &k->noise, err);
        k->has_noise = s == STATUS_OK;
        if (s != STATUS_OK && err != NULL) snprintf(err->field, sizeof err->field, OPTION_CAMERA_NOISE);
    }
    if (s == STATUS_OK) s = photograph_process_load_dark(k, setup, rows, folder, err);
    return s == STATUS_OK ? load_color(k, setup, folder, err) : s;
}
