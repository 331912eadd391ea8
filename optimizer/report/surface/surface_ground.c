#include "optimizer/report/surface/surface_ground.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/report/surface/surface_view.h"
#include "renderer/preview/ground_shadow.h"

#include <math.h>
#include <string.h>

/* The plane's radius in widths of the picture, and rays along an edge of the lamp for each place of a filtered one. */
static const double radius_widths = 3.0;
static const double studio_gap_mm = 0.05;
enum { FILTER_SIDE = 4 };

status surface_ground_init(const struct report *report, size_t i, const struct render_request *q,
                           const struct progress *progress, struct surface_ground *ground, struct error *err)
{
    const struct job_surface_picture *p = &report->in.results->surface_picture[i];
    const bool studio = surface_studio_is(p);
    memset(ground, 0, sizeof *ground);
    if (isnan(p->ground_gap_mm) && (!studio || p->kind == JOB_KIND_LIT_THROUGH)) return STATUS_OK;
    if (q->input.scene.fibers == NULL) {
        worker_status_warn(report->in.job->tools->status,
                           "picture %zu has no ground: the shadow of a volume model is not traced", i + 1);
        return STATUS_OK;
    }
    struct progress silent = progress_silent(progress);
    ground->present = true;
    ground->z_mm = ground_below(q->input.scene.fibers, studio ? studio_gap_mm : p->ground_gap_mm);
    if (studio) return surface_studio_ground(report, q, ground->z_mm, &silent, &ground->layer, err);
    const struct ground_request g = {.scene = q->input.scene.fibers,
                                     .configuration = q->configuration,
                                     .z_mm = ground->z_mm,
                                     .radius_mm = radius_widths * p->width_mm,
                                     .albedo = p->ground_albedo,
                                     .width = q->width,
                                     .height = q->height,
                                     .n_sample = q->n_sample > 1 ? q->n_sample : 2,
                                     .seed = q->seed,
                                     .stream = q->stream};
    status s = ground_render(&g, report->in.job->tools->pool, &silent, &ground->layer, err);
    ground->sheared = q->configuration->light == LIGHT_SQUARE_LAMP;
    if (s == STATUS_OK && p->filter && ground->sheared)
        s = ground_render_filtered(&g, &(struct ground_filter){.n_side = FILTER_SIDE}, report->in.job->tools->pool,
                                   &silent, &ground->filtered, err);
    return s;
}

void surface_ground_release(struct surface_ground *ground)
{
    image_release(&ground->layer);
    image_release(&ground->filtered);
}

static void add_channels(const struct image *from, size_t n_channel, struct image *to)
{
    for (size_t i = 0; i < to->width * to->height; i++)
        for (size_t k = 0; k < n_channel; k++) to->pixel[i * to->n_channel + k] += from->pixel[i * from->n_channel + k];
}

status surface_ground_add(const struct surface_ground *ground, const struct surface_passes *so_far,
                          struct surface_passes *shown, struct error *err)
{
    const struct image *im = &so_far->image;
    *shown = *so_far;
    shown->first = (struct image){0};
    status s = image_init(&shown->image, im->width, im->height, im->n_channel, err);
    if (s != STATUS_OK) return s;
    shown->image.channel_name = im->channel_name;
    memcpy(shown->image.pixel, im->pixel, im->width * im->height * im->n_channel * sizeof *im->pixel);
    if (ground->present) add_channels(&ground->layer, im->n_channel, &shown->image);
    return STATUS_OK;
}

void surface_ground_add_filtered(const struct surface_ground *ground, struct image *view)
{
    if (ground->present) add_channels(ground->sheared ? &ground->filtered : &ground->layer, 3, view);
}
