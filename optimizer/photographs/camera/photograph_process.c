#include "optimizer/photographs/camera/photograph_process.h"

#include "base/files/file_ledger_json.h"
#include "base/option_id.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/photographs/camera/column_views.h"

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
    if (k->carry != NULL) exposure_carry_release(k->carry);
    free(k->carry);
    if (k->columns != NULL) column_views_release(k->columns);
    free(k->columns);
    photograph_process_init(k);
}

/* ---- dark frames ---- */

bool exposure_times_equal(double a, double b)
{
    return (isnan(a) && isnan(b)) || fabs(a - b) <= same_time_rel * fmax(fabs(a), fabs(b));
}

static struct dark_mean *dark_of_time(const struct photograph_process *k, double exposure_s)
{
    for (size_t i = 0; i < k->n_dark; i++)
        if (exposure_times_equal(k->dark[i].exposure_s, exposure_s)) return &k->dark[i];
    return NULL;
}

/* Adds a frame to the sum of its exposure time. Takes the image. */
static status add_dark(struct photograph_process *k, const char *name, const struct photograph_info *info,
                       struct image *im, struct error *err)
{
    struct dark_mean *d = dark_of_time(k, info->exposure_s);
    if (d == NULL) {
        k->dark[k->n_dark++] =
            (struct dark_mean){.exposure_s = info->exposure_s, .n = 1, .orientation = info->orientation, .image = *im};
        return STATUS_OK;
    }
    status s = STATUS_OK;
    if (d->image.width != im->width || d->image.height != im->height)
        s = error_set(err, STATUS_INVALID, "cannot use dark frame '%s': it has %zu x %zu pixels, others have %zu x %zu",
                      name, im->width, im->height, d->image.width, d->image.height);
    else if (d->orientation != info->orientation)
        s = error_set(err, STATUS_INVALID, "cannot use dark frame '%s': its orientation is %u, others have %u", name,
                      info->orientation, d->orientation);
    for (size_t i = 0; i < im->width * im->height * 3 && s == STATUS_OK; i++) d->image.pixel[i] += im->pixel[i];
    d->n++;
    image_release(im);
    return s;
}

status photograph_process_load_dark(struct photograph_process *k, const struct job_setup *setup,
                                    const struct job_rows *rows, const char *folder, struct error *err)
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
        if (s == STATUS_OK) s = add_dark(k, setup->dark_frame[i], &r.info, &im, err);
    }
    for (size_t i = 0; i < k->n_dark && s == STATUS_OK; i++) {
        struct image *im = &k->dark[i].image;
        for (size_t j = 0; j < im->width * im->height * 3; j++) im->pixel[j] /= (float)k->dark[i].n;
    }
    if (s != STATUS_OK && err != NULL) snprintf(err->field, sizeof err->field, OPTION_DARK_FRAMES);
    return s;
}

status photograph_process_subtract_dark(const struct photograph_process *k, const struct job_photograph *p,
                                        const char *name, const struct photograph_record *r, struct image *im,
                                        struct error *err)
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
    if (d->orientation != r->info.orientation)
        return error_set(err, STATUS_INVALID,
                         "cannot use photograph '%s': its orientation is %u, its dark frame's is %u: their sensors are "
                         "turned against each other",
                         name, r->info.orientation, d->orientation);
    for (size_t y = 0; y < im->height; y++) {
        const float *dark = d->image.pixel + 3 * ((y + p->crop_px[1]) * d->image.width + p->crop_px[0]);
        float *to = im->pixel + 3 * y * im->width;
        for (size_t i = 0; i < 3 * im->width; i++)
            if ((double)to[i] < r->info.saturation[i % 3]) to[i] -= dark[i]; /* a saturated sample stays as it is */
    }
    return STATUS_OK;
}

struct exposure_reference photograph_process_reference(const struct photograph_process *k,
                                                       const struct photograph_record *first)
{
    return k->has_color ? k->color_exposure
                        : (struct exposure_reference){first->scale_s, first->info.aperture, first->info.iso};
}
