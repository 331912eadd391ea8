#include "optimizer/photographs/camera/photograph_develop.h"

#include "optimizer/job/document/job_photograph.h"
#include "optimizer/photographs/camera/color_matrix.h"
#include "optimizer/photographs/camera/view_exposures.h"
#include "optimizer/photographs/cylinder/column_picture.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

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

/* Gives the column that was cut its part of the errors of the times, which belong to the mean of all columns. */
static void share_time_error(struct merged_view *e)
{
    const struct image *im = &e->image[0];
    double mean[3] = {0};
    for (size_t i = 0; i < 3 * im->width * im->height; i++)
        mean[i % 3] += (double)im->pixel[i] / (double)(im->width * im->height);
    for (size_t i = 0; i < 3 * e->n; i++)
        e->time_error[i / 3][i % 3] *= e->light_mean[i % 3] > 0.0 ? mean[i % 3] / e->light_mean[i % 3] : 0.0;
}

/* Adds the error of the mean radiance by the errors of the fitted times. */
static void add_time_error(const struct photograph_process *k, const struct merged_view *e, struct photograph_record *r)
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
static double saturated_in_crop(const struct merged_view *e, const size_t crop[4])
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

static status correct_lens(const struct photograph_process *k, const struct job_photograph *p, struct merged_view *e,
                           struct error *err)
{
    double crop[4];
    for (size_t i = 0; i < 4; i++) crop[i] = p->crop_exact_px[2] > 0.0 ? p->crop_exact_px[i] : (double)p->crop_px[i];
    e->record[0].saturated_share = saturated_in_crop(e, p->crop_px);
    status s = lens_correct(&k->lens, crop, &e->image[0], err);
    if (s == STATUS_OK && e->variance.pixel != NULL) s = lens_correct_variance(&k->lens, crop, &e->variance, err);
    return s == STATUS_OK ? s : error_prefix(err, s, "cannot use photograph '%s'", p->file);
}

/* Replaces the crop, and the variances of its pixels, by the column of a cylinder that it holds. */
static status cut_column(const struct photograph_process *k, const struct job_photograph *p, struct merged_view *e,
                         struct error *err)
{
    static const size_t whole[4] = {0};
    const double(*corner)[2] = (const double(*)[2])p->column.corner_px;
    if (p->column.number == 0) return STATUS_OK;
    e->record[0].is_column = true;
    if (!photograph_process_has_lens(k)) e->record[0].saturated_share = saturated_in_crop(e, whole);
    const double(*place)[2] = (const double(*)[2])e->record[0].info.sample_px;
    status s = column_picture_cut(corner, p->crop_px, place, &e->image[0], err);
    return s == STATUS_OK && e->variance.pixel != NULL
               ? column_picture_cut(corner, p->crop_px, place, &e->variance, err)
               : s;
}

status photograph_develop(const struct photograph_process *k, const char *folder, const struct job_photograph *p,
                          struct image *im, struct photograph_record *record, struct error *err)
{
    struct merged_view *e = calloc(1, sizeof *e);
    if (e == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read photograph '%s': out of memory", p->file);
    memset(im, 0, sizeof *im);
    status s = view_exposures_read(k, folder, p, e, err);
    if (s == STATUS_OK && photograph_process_has_lens(k)) s = correct_lens(k, p, e, err);
    if (s == STATUS_OK) s = cut_column(k, p, e, err);
    if (s == STATUS_OK) {
        struct photograph_record *r = &e->record[0];
        const double factor = p->scale / r->exposure * distance_factor(k, p);
        mean_error(&e->variance, r->noise_se_rgb);
        if (r->is_column) share_time_error(e);
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
    merged_view_release(e);
    free(e);
    return s;
}
