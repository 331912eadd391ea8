#include "optimizer/report/surface/surface_studio.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/job/document/json_number.h"
#include "optimizer/report/result/result_pictures.h"
#include "optimizer/report/result/result_thumbnail.h"
#include "optimizer/report/surface/surface_scale_bar.h"
#include "renderer/image/tone_curve.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The cloth alone, filtered where it can be. */
static status shown_cloth(const struct report *report, const struct surface_filter *filter,
                          const struct surface_passes *so_far, struct image *out, double *error, struct error *err)
{
    const struct image *im = &so_far->image;
    *error = NAN;
    if (surface_filter_can(filter, so_far)) return surface_filter_view(report, filter, so_far, out, error, err);
    status s = image_init(out, im->width, im->height, 3, err);
    for (size_t i = 0; s == STATUS_OK && i < im->width * im->height; i++)
        memcpy(out->pixel + 3 * i, im->pixel + i * im->n_channel, 3 * sizeof *out->pixel);
    return s;
}

status surface_studio_write(struct report *report, size_t i, const struct surface_filter *filter,
                            const struct surface_ground *ground, const struct surface_passes *so_far,
                            struct surface_shown *how, struct error *err)
{
    const struct job_surface_picture *p = &report->in.results->surface_picture[i];
    struct image shown;
    status s = shown_cloth(report, filter, so_far, &shown, &how->error, err);
    if (s != STATUS_OK) return s;
    surface_ground_add_filtered(ground, &shown);
    uint8_t *rgb = malloc(3 * p->px * p->px);
    if (rgb == NULL) s = error_set(err, STATUS_NO_MEMORY, "cannot write a picture: out of memory");
    if (s == STATUS_OK) tone_curve_bytes(&shown, how->exposure, rgb);
    image_release(&shown);
    if (s == STATUS_OK && p->on == JOB_ON_FLAT) surface_scale_bar_draw(rgb, p->px, p->width_mm);
    if (s == STATUS_OK) s = result_picture_write(report, so_far->name, rgb, p->px, p->px, err);
    if (s == STATUS_OK && so_far->n_sample == p->sample) s = result_thumbnail_of_bytes(report, rgb, p->px, p->px, err);
    free(rgb);
    return s;
}

void surface_studio_put(json_t *entry, const struct job_surface_picture *p, const struct surface_filter *filter,
                        const struct surface_shown *how)
{
    json_object_set_new(entry, "kind", json_string(job_picture_kind_name(p->kind)));
    if (p->is_draft || json_integer_value(json_object_get(entry, "samples")) < (json_int_t)p->sample)
        json_object_set_new(entry, "partial", json_true());
    json_object_set_new(entry, "tone_curve", json_string("khronos_pbr_neutral"));
    if (filter->guides.feature.pixel != NULL) json_object_set_new(entry, "filter", json_string(JOINT_FILTER_ID));
    if (isfinite(how->error)) json_object_set_new(entry, "noise", json_number(how->error));
}
