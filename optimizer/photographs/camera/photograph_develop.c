#include "optimizer/photographs/camera/photograph_develop.h"

#include "base/angle.h"
#include "base/files/file_ledger_json.h"
#include "base/option_id.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/photographs/camera/color_matrix.h"
#include "optimizer/photographs/camera/exposure_merge.h"
#include "optimizer/photographs/camera/marker_views.h"
#include "optimizer/photographs/camera/rig.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PATH_BYTES = 4096 };
static const double same_time_rel = 0.01;

void photograph_process_init(struct photograph_process *k) { *k = (struct photograph_process){0}; }

void photograph_process_release(struct photograph_process *k)
{
    for (size_t i = 0; i < k->n_dark; i++) image_release(&k->dark[i].image);
    free(k->dark);
    image_release(&k->chart_picture);
    photograph_process_init(k);
}

/* ---- dark frames ---- */

/* Returns whether two exposure times are equal, or both unknown. */
static bool same_time(double a, double b)
{
    return (isnan(a) && isnan(b)) || fabs(a - b) <= same_time_rel * fmax(fabs(a), fabs(b));
}

static struct dark_mean *dark_of_time(const struct photograph_process *k, double exposure_s)
{
    for (size_t i = 0; i < k->n_dark; i++)
        if (same_time(k->dark[i].exposure_s, exposure_s)) return &k->dark[i];
    return NULL;
}

/* Adds a frame to the sum of its exposure time. Takes the image. */
static status add_dark(struct photograph_process *k, const char *name, double exposure_s, struct image *im,
                       struct error *err)
{
    struct dark_mean *d = dark_of_time(k, exposure_s);
    if (d == NULL) {
        k->dark[k->n_dark++] = (struct dark_mean){.exposure_s = exposure_s, .n = 1, .image = *im};
        return STATUS_OK;
    }
    status s = STATUS_OK;
    if (d->image.width != im->width || d->image.height != im->height)
        s = error_set(err, STATUS_INVALID, "cannot use dark frame '%s': it has %zu x %zu pixels, others have %zu x %zu",
                      name, im->width, im->height, d->image.width, d->image.height);
    for (size_t i = 0; i < im->width * im->height * 3 && s == STATUS_OK; i++) d->image.pixel[i] += im->pixel[i];
    d->n++;
    image_release(im);
    return s;
}

static status load_dark(struct photograph_process *k, const struct job_setup *setup, const struct job_rows *rows,
                        const char *folder, struct error *err)
{
    if (setup->n_dark_frame == 0) return STATUS_OK;
    k->dark = calloc(setup->n_dark_frame, sizeof *k->dark);
    if (k->dark == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read dark frames: out of memory");
    const struct job_photograph plain =
        photograph_plain(rows->n_photograph > 0 ? rows->photograph[0].transfer : JOB_TRANSFER_LINEAR);
    status s = STATUS_OK;
    for (size_t i = 0; i < setup->n_dark_frame && s == STATUS_OK; i++) {
        char path[PATH_BYTES];
        struct image im;
        struct photograph_record r;
        snprintf(path, sizeof path, "%s/%s", folder, setup->dark_frame[i]);
        s = photograph_read_values(path, &plain, &im, &r, err);
        if (s == STATUS_OK) file_ledger_append(k->files, setup->dark_frame[i], &r.info.ledger);
        if (s == STATUS_OK) s = add_dark(k, setup->dark_frame[i], r.info.exposure_s, &im, err);
    }
    for (size_t i = 0; i < k->n_dark && s == STATUS_OK; i++) {
        struct image *im = &k->dark[i].image;
        for (size_t j = 0; j < im->width * im->height * 3; j++) im->pixel[j] /= (float)k->dark[i].n;
    }
    if (s != STATUS_OK && err != NULL) snprintf(err->field, sizeof err->field, OPTION_DARK_FRAMES);
    return s;
}

/* Subtracts the dark frame of the same exposure time from a crop. */
static status subtract_dark(const struct photograph_process *k, const struct job_photograph *p, const char *name,
                            const struct photograph_record *r, struct image *im, struct error *err)
{
    if (k->n_dark == 0) return STATUS_OK;
    const struct dark_mean *d = dark_of_time(k, r->info.exposure_s);
    if (d == NULL)
        return error_set(
            err, STATUS_INVALID,
            "cannot use photograph '%s': no dark frame has its exposure time (%g s): take one with the lens "
            "covered",
            name, r->info.exposure_s);
    if (d->image.width != r->width || d->image.height != r->height)
        return error_set(err, STATUS_INVALID,
                         "cannot use photograph '%s': it has %zu x %zu pixels, its dark frame has %zu x %zu", name,
                         r->width, r->height, d->image.width, d->image.height);
    for (size_t y = 0; y < im->height; y++) {
        const float *dark = d->image.pixel + 3 * ((y + p->crop_px[1]) * d->image.width + p->crop_px[0]);
        float *to = im->pixel + 3 * y * im->width;
        for (size_t i = 0; i < 3 * im->width; i++)
            if (to[i] < 1.0f || r->info.full_scale == 1.0) to[i] -= dark[i]; /* a saturated sample stays at 1 */
    }
    return STATUS_OK;
}

/* ---- exposures ---- */

struct exposures {
    size_t n;
    const char *name[EXPOSURE_MAX];
    struct image image[EXPOSURE_MAX];
    struct photograph_record record[EXPOSURE_MAX];
    struct image variance; /* of the merged picture by the camera's noise; no pixels without a record */
};

static bool has_lens(const struct photograph_process *k) { return k->lens.has_vignetting || k->lens.has_distortion; }

static status read_exposure(const struct photograph_process *k, const char *folder, const struct job_photograph *p,
                            size_t i, struct exposures *e, struct error *err)
{
    struct job_photograph own = *p;
    char path[PATH_BYTES];
    e->name[i] = i == 0 ? p->file : p->exposure[i - 1].file;
    if (has_lens(k)) memset(own.crop_px, 0, sizeof own.crop_px); /* the crop is one of the corrected picture */
    if (i > 0) own.exposure_s = p->exposure[i - 1].exposure_s;
    snprintf(path, sizeof path, "%s/%s", folder, e->name[i]);
    status s = photograph_read_values(path, &own, &e->image[i], &e->record[i], err);
    if (s != STATUS_OK) return s;
    e->n++;
    file_ledger_append(k->files, e->name[i], &e->record[i].info.ledger);
    return subtract_dark(k, &own, e->name[i], &e->record[i], &e->image[i], err);
}

static bool differ(double a, double b) { return !(a == b || (isnan(a) && isnan(b))); }

static status check_exposures(const struct exposures *e, struct error *err)
{
    for (size_t i = 0; i < e->n; i++) {
        const struct photograph_record *a = &e->record[0], *b = &e->record[i];
        const char *what = a->width != b->width || a->height != b->height ? "sizes"
                           : differ(a->info.iso, b->info.iso)             ? "ISO values"
                           : differ(a->info.aperture, b->info.aperture)   ? "f-numbers"
                                                                          : NULL;
        if (what != NULL)
            return error_set(err, STATUS_INVALID,
                             "cannot merge the exposures '%s' and '%s' of one view: they have different %s", e->name[0],
                             e->name[i], what);
        if (isnan(b->info.exposure_s))
            return error_set(err, STATUS_INVALID,
                             "cannot use photograph '%s': its exposure time is not known: write 'exposure_s' beside it",
                             e->name[i]);
    }
    return STATUS_OK;
}

static status check_noise(const struct photograph_process *k, const struct exposures *e, struct error *err)
{
    const struct photograph_info *info = &e->record[0].info;
    if (!k->has_noise) return STATUS_OK;
    if (info->encoded ? info->less_trustworthy : info->full_scale == 1.0)
        return error_set(err, STATUS_INVALID,
                         "cannot use photograph '%s' with a record of the camera's noise: the record counts in values "
                         "of raw files, and this is %s %s",
                         e->name[0], info->bits == 32 ? "float" : "a processed", info->format);
    if (!isnan(k->noise.iso) && !isnan(info->iso) && k->noise.iso != info->iso)
        return error_set(
            err, STATUS_INVALID,
            "cannot use photograph '%s' with the record of the camera's noise: it was taken at ISO %g, the "
            "record at ISO %g",
            e->name[0], info->iso, k->noise.iso);
    return STATUS_OK;
}

/* Merges into image[0], which keeps the unit of the first exposure. */
static status merge(const struct photograph_process *k, struct exposures *e, struct error *err)
{
    struct noise_record noise = k->noise;
    double t_s[EXPOSURE_MAX], full_scale[EXPOSURE_MAX];
    struct image *image[EXPOSURE_MAX];
    struct photograph_record *r = &e->record[0];
    for (size_t c = 0; c < 3 && k->n_dark > 0; c++) /* dark frames hold the mean of both noises */
        noise.channel[c].read_mean = noise.channel[c].dark_mean = 0.0;
    for (size_t i = 0; i < e->n; i++) {
        t_s[i] = e->record[i].info.exposure_s;
        full_scale[i] = e->record[i].info.full_scale;
        image[i] = &e->image[i];
    }
    status s = k->has_noise ? image_init(&e->variance, image[0]->width, image[0]->height, 3, err) : STATUS_OK;
    if (s != STATUS_OK) return s;
    s = exposure_check_agreement(k->has_noise ? &noise : NULL, e->n, t_s, full_scale, image, e->name, err);
    if (s != STATUS_OK) return s;
    s = exposure_merge_images(k->has_noise ? &noise : NULL, e->n, t_s, full_scale, image,
                              k->has_noise ? &e->variance : NULL, &r->saturated_share, err);
    if (s != STATUS_OK) return s;
    r->merged = true;
    r->n_exposure = e->n;
    image_scale(image[0], t_s[0]); /* the first one's time is divided by later */
    if (k->has_noise) image_scale(&e->variance, t_s[0] * t_s[0]);
    return STATUS_OK;
}

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
    for (size_t c = 0; c < 3; c++) color_matrix_error(k->matrix_cov[c], mean, r->color_error[c]);
    color_matrix_apply_image(k->matrix, im);
    for (size_t c = 0; c < 9; c++)
        out[c / 3] += k->matrix[c] * k->matrix[c] * r->noise_se_rgb[c % 3] * r->noise_se_rgb[c % 3];
    for (size_t c = 0; c < 3; c++) r->noise_se_rgb[c] = sqrt(out[c]);
}

/* A lamp at twice the distance gives a quarter of the light, and radiances are relative to the light that there is. */
static double distance_factor(const struct photograph_process *k, const struct job_photograph *p)
{
    double ratio = p->light_distance_cm / k->lamp_distance_cm;
    return ratio > 0.0 ? ratio * ratio : 1.0;
}

/* Share of the crop's pixels, in the picture before the correction of the lens, that are saturated in all exposures.
 * Those have at least the value of full scale in the shortest one. */
static double saturated_in_crop(const struct exposures *e, const size_t crop[4])
{
    const struct image *im = &e->image[0];
    const struct photograph_info *info = &e->record[0].info;
    size_t x1 = crop[2] > 0 ? crop[2] : im->width, y1 = crop[3] > 0 ? crop[3] : im->height, n = 0;
    double shortest_s = info->exposure_s;
    for (size_t i = 1; i < e->n; i++) shortest_s = fmin(shortest_s, e->record[i].info.exposure_s);
    const float limit = e->n > 1 ? (float)(0.999999 * info->exposure_s / shortest_s) : 1.0f;
    if (info->full_scale == 1.0 || x1 > im->width || y1 > im->height) return 0.0;
    for (size_t y = crop[1]; y < y1; y++)
        for (size_t x = crop[0]; x < x1; x++) {
            const float *p = im->pixel + 3 * (y * im->width + x);
            n += fmaxf(p[0], fmaxf(p[1], p[2])) >= limit;
        }
    return (double)n / (double)((x1 - crop[0]) * (y1 - crop[1]));
}

static status correct_lens(const struct photograph_process *k, const struct job_photograph *p, struct exposures *e,
                           struct error *err)
{
    double crop[4];
    for (size_t i = 0; i < 4; i++) crop[i] = p->crop_exact_px[2] > 0.0 ? p->crop_exact_px[i] : (double)p->crop_px[i];
    e->record[0].saturated_share = saturated_in_crop(e, p->crop_px);
    status s = lens_correct(&k->lens, crop, &e->image[0], err);
    if (s == STATUS_OK && e->variance.pixel != NULL) s = lens_correct_variance(&k->lens, crop, &e->variance, err);
    return s == STATUS_OK ? s : error_prefix(err, s, "cannot use photograph '%s'", p->file);
}

static status read_exposures(const struct photograph_process *k, const char *folder, const struct job_photograph *p,
                             struct exposures *e, struct error *err)
{
    status s = STATUS_OK;
    for (size_t i = 0; i <= p->n_exposure && s == STATUS_OK; i++) s = read_exposure(k, folder, p, i, e, err);
    if (s != STATUS_OK || (p->n_exposure == 0 && !k->has_noise)) return s;
    s = check_exposures(e, err);
    if (s == STATUS_OK) s = check_noise(k, e, err);
    return s == STATUS_OK ? merge(k, e, err) : s;
}

status photograph_develop(const struct photograph_process *k, const char *folder, const struct job_photograph *p,
                          struct image *im, struct photograph_record *record, struct error *err)
{
    struct exposures *e = calloc(1, sizeof *e);
    if (e == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read photograph '%s': out of memory", p->file);
    memset(im, 0, sizeof *im);
    status s = read_exposures(k, folder, p, e, err);
    if (s == STATUS_OK && has_lens(k)) s = correct_lens(k, p, e, err);
    if (s == STATUS_OK) {
        struct photograph_record *r = &e->record[0];
        const double factor = p->scale / r->exposure * distance_factor(k, p);
        mean_error(&e->variance, r->noise_se_rgb);
        if (k->has_color) apply_color(k, &e->image[0], r);
        image_scale(&e->image[0], factor);
        for (size_t c = 0; c < 3; c++) {
            r->noise_se_rgb[c] *= factor;
            for (size_t cause = 0; cause < 3; cause++) r->color_error[c][cause] *= factor;
        }
        *im = e->image[0];
        if (record != NULL) *record = *r;
    }
    for (size_t i = s == STATUS_OK ? 1 : 0; i < e->n; i++) image_release(&e->image[i]);
    image_release(&e->variance);
    free(e);
    return s;
}

/* ---- color ---- */

/* Value from which on a developed sample was saturated. */
static double saturation_of(const struct photograph_record *r)
{
    return r->info.full_scale != 1.0 ? 0.999999 / r->exposure : INFINITY;
}

static status load_chart(struct photograph_process *k, const struct job_setup *setup, const char *folder,
                         struct error *err)
{
    struct image im;
    struct photograph_record r;
    status s = photograph_develop(k, folder, &setup->chart, &im, &r, err);
    if (s != STATUS_OK) return s;
    memcpy(k->chart.corner_px, setup->chart_corner_px, sizeof k->chart.corner_px);
    k->chart.from_2014 = setup->chart_from_2014;
    s = color_chart_find(&im, k->chart.corner_px, &k->chart.found_automatically, err);
    if (s == STATUS_NOT_FOUND)
        s = error_set(err, STATUS_INVALID, "no chart was found: give the corners of its patches ('corners_px')");
    if (s == STATUS_OK)
        s = color_chart_measure(&k->chart, &im, saturation_of(&r), setup->chart.light_theta_deg * RAD_PER_DEG, err);
    if (s == STATUS_OK) s = color_chart_picture(&k->chart, &im, &k->chart_picture, err);
    image_release(&im);
    if (s != STATUS_OK) return error_prefix(err, s, "cannot use color chart '%s'", setup->chart.file);
    memcpy(k->matrix, k->chart.matrix, sizeof k->matrix);
    memcpy(k->matrix_cov, k->chart.matrix_cov, sizeof k->matrix_cov);
    k->color_info = r.info;
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
        k->matrix_cov[c][4 * c] = pow(k->matrix[4 * c] * mean.se_rgb[c] / mean.mean_rgb[c], 2.0);
    }
    k->color_info = mean.record.info;
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
    k->lamp_distance_cm = setup->lamp_directional ? NAN : setup->lamp_distance_cm;
    if (s == STATUS_OK && setup->noise_file[0] != '\0') {
        snprintf(path, sizeof path, "%s/%s", folder, setup->noise_file);
        s = noise_record_read(path, &k->noise, err);
        k->has_noise = s == STATUS_OK;
        if (s != STATUS_OK && err != NULL) snprintf(err->field, sizeof err->field, OPTION_CAMERA_NOISE);
    }
    if (s == STATUS_OK) s = load_dark(k, setup, rows, folder, err);
    return s == STATUS_OK ? load_color(k, setup, folder, err) : s;
}
