#include "optimizer/photographs/camera/view_exposures.h"

#include "base/files/file_ledger_json.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/photographs/camera/column_views.h"
#include "optimizer/photographs/camera/exposure_ratio.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PATH_BYTES = 4096 };

static status read_exposure(const struct photograph_process *k, const char *folder, const struct job_photograph *p,
                            size_t i, struct merged_view *e, struct error *err)
{
    struct job_photograph own = *p;
    char path[PATH_BYTES];
    e->name[i] = i == 0 ? p->file : p->exposure[i - 1].file;
    if (photograph_process_has_lens(k))
        memset(own.crop_px, 0, sizeof own.crop_px); /* the crop is one of the corrected picture */
    if (i > 0) own.exposure_s = p->exposure[i - 1].exposure_s;
    snprintf(path, sizeof path, "%s/%s", folder, e->name[i]);
    status s = photograph_read_values(path, &own, &e->image[i], &e->record[i], err);
    if (s != STATUS_OK) return s;
    e->n++;
    return photograph_process_subtract_dark(k, &own, e->name[i], &e->record[i], &e->image[i], err);
}

static bool differ(double a, double b) { return !(a == b || (isnan(a) && isnan(b))); }

static status check_exposures(const struct merged_view *e, struct error *err)
{
    for (size_t i = 0; i < e->n; i++) {
        const struct photograph_record *a = &e->record[0], *b = &e->record[i];
        const char *what = a->width != b->width || a->height != b->height ? "sizes"
                           : a->info.orientation != b->info.orientation   ? "orientations"
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

static status check_noise(const struct photograph_process *k, const struct merged_view *e, struct error *err)
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

/* The crop of the picture that was read, which is a part of it where the lens is corrected later. */
static void region_of_crop(const struct job_photograph *p, const struct image *im, size_t region[4])
{
    const size_t whole[4] = {0, 0, im->width, im->height}, *crop = p->crop_px;
    const bool part = crop[2] > crop[0] && crop[3] > crop[1] && crop[2] <= im->width && crop[3] <= im->height;
    memcpy(region, part ? crop : whole, sizeof whole);
}

/* Errors of the mean of each channel by each cause of the errors of the fitted times. */
static void time_error(const struct exposure_ratio *ratio, size_t n, const struct exposure_light *light,
                       double error[EXPOSURE_MAX][3])
{
    for (size_t k = 0; k < n; k++)
        for (size_t c = 0; c < 3; c++)
            for (size_t i = 0; i < n; i++) error[k][c] -= ratio->log_error[i][k] * light->light[i][c];
}

/* Enters the fitted time beside the stated one. */
static void enter_time(struct merged_view *e, size_t i, const struct exposure_ratio *ratio)
{
    char reason[FILE_STATEMENT_BYTES] = "";
    struct file_ledger *ledger = &e->record[i].info.ledger;
    const struct file_statement *stated = file_ledger_find(ledger, "exposure time");
    if (stated == NULL || e->n < 2) return;
    snprintf(reason, sizeof reason, "%s", stated->reason);
    char value[FILE_STATEMENT_BYTES];
    snprintf(value, sizeof value, "%.40s", stated->value);
    if (i == ratio->i_scale)
        file_ledger_add(ledger, "exposure time", reason, "%s, the other exposures are measured against it", value);
    else
        file_ledger_add(ledger, "exposure time", reason, "%s; the fitted ratio says %.4g s +- %.2g %%", value,
                        ratio->t_s[i], 100.0 * exposure_ratio_error(ratio, i));
}

/* Ranks exposures by the rounding of their times against the time of the chart. */
static void rank_exposures(const struct photograph_process *k, const struct merged_view *e, double rank[EXPOSURE_MAX])
{
    const double of_color = exposure_time_rounding(k->color_exposure.time_s);
    for (size_t i = 0; i < e->n; i++) {
        const double t_s = e->record[i].info.exposure_s;
        const bool same = k->has_color && exposure_times_equal(t_s, k->color_exposure.time_s);
        rank[i] = !k->has_color || same ? 0.0 : 1e-3 + fabs(exposure_time_rounding(t_s) - of_color);
    }
}

/* Scales an exposure so that 1 is saturation, as the estimator has it. Returns the factor that was divided by. */
static double scale_to_saturation(const struct photograph_info *info, struct image *im, double *full_scale)
{
    double level = photograph_saturation(info);
    *full_scale = info->full_scale;
    if (!isfinite(level) || (level == 1.0 && *full_scale != 1.0)) return 1.0;
    if (*full_scale == 1.0) level *= 1.0 - 1e-6; /* a full scale of 1 stands for samples that do not saturate */
    image_scale(im, 1.0 / level);
    *full_scale *= level;
    return level;
}

/* What the estimator takes of a view: its exposures, scaled to saturation. */
struct scaled_view {
    struct noise_record noise;
    double full_scale[EXPOSURE_MAX], stated_s[EXPOSURE_MAX], level; /* level: that image[0] was divided by */
    struct image *image[EXPOSURE_MAX];
    struct exposure_set set; /* of the members above */
};

static void scale_view(const struct photograph_process *k, struct merged_view *e, struct scaled_view *v)
{
    v->noise = k->noise;
    for (size_t c = 0; c < 3 && k->n_dark > 0; c++) /* dark frames hold the mean of both noises */
        v->noise.channel[c].read_mean = v->noise.channel[c].dark_mean = 0.0;
    for (size_t i = 0; i < e->n; i++) {
        v->stated_s[i] = e->record[i].info.exposure_s;
        const double own = scale_to_saturation(&e->record[i].info, &e->image[i], &v->full_scale[i]);
        if (i == 0) v->level = own;
        v->image[i] = &e->image[i];
    }
    v->set = (struct exposure_set){k->has_noise ? &v->noise : NULL,
                                   e->n,
                                   v->image[0]->width,
                                   v->image[0]->height,
                                   v->stated_s,
                                   v->full_scale,
                                   v->image,
                                   e->name,
                                   e->record[0].info.curved};
}

/* Reads and checks all exposures of p. */
static status read_view(const struct photograph_process *k, const char *folder, const struct job_photograph *p,
                        struct merged_view *e, struct error *err)
{
    status s = STATUS_OK;
    for (size_t i = 0; i <= p->n_exposure && s == STATUS_OK; i++) s = read_exposure(k, folder, p, i, e, err);
    if (s != STATUS_OK || (p->n_exposure == 0 && !k->has_noise)) return s;
    s = check_exposures(e, err);
    return s == STATUS_OK ? check_noise(k, e, err) : s;
}

/* Compares the exposures of a view of the job. A view that cannot be used says so when it is developed. */
static status search_view(const struct photograph_process *k, const char *folder, const struct job_photograph *p,
                          struct error *err)
{
    struct exposure_pair pair[EXPOSURE_MAX];
    struct merged_view *e = calloc(1, sizeof *e);
    struct scaled_view *v = calloc(1, sizeof *v);
    status s = e != NULL && v != NULL ? STATUS_OK
                                      : error_set(err, STATUS_NO_MEMORY, "cannot compare exposures: out of memory");
    if (s == STATUS_OK && read_view(k, folder, p, e, NULL) == STATUS_OK) {
        scale_view(k, e, v);
        if (exposure_pairs_compare(&v->set, pair, NULL) == STATUS_OK)
            s = exposure_carry_add(k->carry, &v->set, &e->record[0].info, pair, err);
    }
    if (e != NULL) merged_view_release(e);
    free(e);
    free(v);
    return s;
}

/* Gives exposures that cannot be compared in this view the ratios of others. All views are read for this, once. */
static status take_carried(const struct photograph_process *k, const char *folder, const struct merged_view *e,
                           const struct exposure_set *set, struct exposure_pair *pair, struct error *err)
{
    bool wanted = false;
    status s = STATUS_OK;
    for (size_t i = 0; i + 1 < set->n; i++) wanted = wanted || !isfinite(pair[i].var);
    if (!wanted || k->carry == NULL || k->rows == NULL) return STATUS_OK;
    for (size_t i = 0; i < k->rows->n_photograph && !k->carry->searched && s == STATUS_OK; i++)
        if (k->rows->photograph[i].n_exposure > 0 && k->rows->photograph[i].column.number <= 1)
            s = search_view(k, folder, &k->rows->photograph[i], err);
    k->carry->searched = s == STATUS_OK;
    exposure_carry_fill(k->carry, set, &e->record[0].info, pair);
    return s;
}

/* Fits the times of the exposures. */
static status fit_times(const struct photograph_process *k, const char *folder, struct merged_view *e,
                        const struct exposure_set *set, struct exposure_ratio *ratio, struct error *err)
{
    double rank[EXPOSURE_MAX];
    struct exposure_pair pair[EXPOSURE_MAX];
    rank_exposures(k, e, rank);
    status s = exposure_pairs_compare(set, pair, err);
    if (s == STATUS_OK) s = take_carried(k, folder, e, set, pair, err);
    if (s == STATUS_OK) s = exposure_ratio_solve(set, rank, pair, ratio, err);
    for (size_t i = 0; i < e->n && s == STATUS_OK; i++) enter_time(e, i, ratio);
    return s;
}

/* Merges into image[0], which keeps the unit of the first exposure. */
static status merge(const struct photograph_process *k, const char *folder, const struct job_photograph *p,
                    struct merged_view *e, struct error *err)
{
    struct photograph_record *r = &e->record[0];
    struct scaled_view v = {.level = 1.0};
    struct exposure_ratio ratio;
    struct exposure_light light = {0};
    scale_view(k, e, &v);
    struct image *const first = v.image[0];
    status s = k->has_noise ? image_init(&e->variance, first->width, first->height, 3, err) : STATUS_OK;
    if (s == STATUS_OK) s = fit_times(k, folder, e, &v.set, &ratio, err);
    if (s != STATUS_OK) return s;
    region_of_crop(p, first, light.region);
    v.set.t_s = ratio.t_s;
    s = exposure_merge_images(&v.set, k->has_noise ? &e->variance : NULL, &light, &r->saturated_share, err);
    if (s != STATUS_OK) return s;
    r->merged = true;
    r->n_exposure = e->n;
    r->scale_s = v.stated_s[ratio.i_scale];
    memcpy(r->fitted_s, ratio.t_s, sizeof r->fitted_s);
    snprintf(r->exposure_warning, sizeof r->exposure_warning, "%s", ratio.warning);
    time_error(&ratio, e->n, &light, e->time_error);
    for (size_t i = 0; i < 3 * e->n; i++) e->time_error[i / 3][i % 3] *= v.stated_s[0];
    for (size_t i = 0; i < 3 * e->n; i++) e->time_error[i / 3][i % 3] *= v.level;
    for (size_t i = 0; i < 3 * e->n; i++) e->light_mean[i % 3] += light.light[i / 3][i % 3] * v.level * v.stated_s[0];
    image_scale(first, v.level * v.stated_s[0]); /* the first one's time is divided by later */
    if (k->has_noise) image_scale(&e->variance, v.level * v.level * v.stated_s[0] * v.stated_s[0]);
    return STATUS_OK;
}

static status read_and_merge(const struct photograph_process *k, const char *folder, const struct job_photograph *p,
                             struct merged_view *e, struct error *err)
{
    status s = read_view(k, folder, p, e, err);
    if (s == STATUS_OK && (p->n_exposure > 0 || k->has_noise)) s = merge(k, folder, p, e, err);
    for (size_t i = 0; i < e->n; i++) file_ledger_append(k->files, e->name[i], &e->record[i].info.ledger);
    return s;
}

status view_exposures_read(const struct photograph_process *k, const char *folder, const struct job_photograph *p,
                           struct merged_view *e, struct error *err)
{
    if (p->column.number == 0 || k->columns == NULL) return read_and_merge(k, folder, p, e, err);
    if (!column_views_has(k->columns, p)) {
        struct job_photograph all = *p;
        memcpy(all.crop_px, p->column.view_px, sizeof all.crop_px);
        status s = read_and_merge(k, folder, &all, e, err);
        if (s != STATUS_OK) return s;
        column_views_keep(k->columns, p, e);
    }
    return column_views_copy(k->columns, p, !photograph_process_has_lens(k), e, err);
}
