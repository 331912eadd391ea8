#include "optimizer/photographs/profile/bowl_pictures.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_profile.h"
#include "optimizer/photographs/camera/photograph_process_load.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

status bowl_pictures_name_field(size_t i, status s, struct error *err)
{
    if (s != STATUS_OK && err != NULL) snprintf(err->field, sizeof err->field, OPTION_BOWL_PHOTOGRAPH "[%zu]", i);
    return s;
}

status bowl_pictures_init(struct bowl_pictures *p, const struct job_bowl *bowl, struct job_setup *setup,
                          struct job_rows *rows, const char *folder, struct error *err)
{
    *p = (struct bowl_pictures){.bowl = bowl, .folder = folder};
    photograph_process_init(&p->process);
    return photograph_process_load(&p->process, setup, rows, folder, err);
}

void bowl_pictures_release(struct bowl_pictures *p)
{
    photograph_process_release(&p->process);
    image_release(&p->mask);
    image_release(&p->photograph);
    image_release(&p->background);
}

/* Value from which on a sample is saturated in every exposure, after it was divided by the exposure. INFINITY where
 * that is not known: for samples without a limit, and for exposures whose times only their files state. */
static double saturation_of(const struct photograph_record *r, const struct job_photograph *p)
{
    double shortest_s = r->info.exposure_s;
    for (size_t i = 0; i < p->n_exposure; i++) {
        if (isnan(p->exposure[i].exposure_s)) return INFINITY;
        shortest_s = fmin(shortest_s, p->exposure[i].exposure_s);
    }
    const double ratio = p->n_exposure > 0 ? r->info.exposure_s / shortest_s : 1.0;
    return 0.999999 * ratio * photograph_saturation(&r->info) / r->exposure;
}

static status develop(const struct bowl_pictures *p, const struct job_photograph *photograph, struct image *im,
                      struct photograph_record *record, struct error *err)
{
    struct job_photograph whole = *photograph;
    whole.scale = 1.0;
    image_release(im);
    return photograph_develop(&p->process, p->folder, &whole, im, record, err);
}

static status same_size(const struct bowl_pictures *p, size_t i, const char *name, const struct image *im,
                        struct error *err)
{
    if (im->width == p->width && im->height == p->height) return STATUS_OK;
    return bowl_pictures_error(i, err, "cannot use '%s' of the bowl: it has %zu x %zu pixels, and '%s' has %zu x %zu",
                               name, im->width, im->height, p->bowl->photograph[0].picture.file, p->width, p->height);
}

static status first_photograph(struct bowl_pictures *p, struct error *err)
{
    const struct job_bowl *b = p->bowl;
    p->width = p->photograph.width;
    p->height = p->photograph.height;
    status s = bowl_camera_fit(b, &p->process.lens, p->width, p->height, &p->camera, err);
    if (s != STATUS_OK || b->mask[0] == '\0') return s;
    struct job_photograph plain = photograph_assumed(JOB_TRANSFER_LINEAR);
    char path[4096];
    snprintf(path, sizeof path, "%s/%s", p->folder, b->mask);
    s = photograph_read(path, &plain, &p->mask, NULL, err);
    if (s == STATUS_OK) s = same_size(p, 0, b->mask, &p->mask, err);
    if (s != STATUS_OK && err != NULL) snprintf(err->field, sizeof err->field, OPTION_BOWL_MASK);
    return s;
}

static status open_background(struct bowl_pictures *p, size_t i, struct error *err)
{
    const struct job_bowl_photograph *shot = &p->bowl->photograph[i];
    struct job_photograph picture = shot->picture;
    if (shot->background[0] == '\0') return STATUS_OK;
    memcpy(picture.file, shot->background, sizeof picture.file);
    picture.n_exposure = 0;
    status s = develop(p, &picture, &p->background, NULL, err);
    return s == STATUS_OK ? same_size(p, i, shot->background, &p->background, err)
                          : bowl_pictures_name_field(i, s, err);
}

status bowl_pictures_open(struct bowl_pictures *p, size_t i, struct error *err)
{
    const struct job_photograph *picture = &p->bowl->photograph[i].picture;
    struct photograph_record record;
    image_release(&p->background);
    memset(&p->background, 0, sizeof p->background);
    status s = develop(p, picture, &p->photograph, &record, err);
    if (s != STATUS_OK) return bowl_pictures_name_field(i, s, err);
    p->saturated = saturation_of(&record, picture);
    s = i == 0 || p->width == 0 ? first_photograph(p, err) : same_size(p, i, picture->file, &p->photograph, err);
    return s == STATUS_OK ? open_background(p, i, err) : s;
}

bool bowl_pictures_place(const struct bowl_pictures *p, size_t k, struct bowl_place *place)
{
    const double px[2] = {(double)(k % p->width) + 0.5, (double)(k / p->width) + 0.5};
    if (p->mask.pixel != NULL && p->mask.pixel[3 * k + 1] < 0.5f) return false;
    return bowl_place_at(p->bowl, &p->camera, px, place);
}

bool bowl_pictures_value(const struct bowl_pictures *p, size_t k, double value[3], double background[3])
{
    bool valid = true;
    for (size_t c = 0; c < 3; c++) {
        value[c] = (double)p->photograph.pixel[3 * k + c];
        background[c] = p->background.pixel != NULL ? (double)p->background.pixel[3 * k + c] : 0.0;
        valid = valid && value[c] < p->saturated && isfinite(value[c]) && background[c] < p->saturated;
    }
    return valid;
}
