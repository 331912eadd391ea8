#include "optimizer/report/surface/surface_preview.h"
#include "base/process.h"
#include "optimizer/job/document/job_results.h"
#include "renderer/preview/proxy/proxy_picture.h"

#include <string.h>

status surface_preview_render(const struct report *report, size_t i, const struct appearance_table *look,
                              const struct render_request *q, const struct progress *progress,
                              struct surface_passes *so_far, struct error *err)
{
    const struct job_surface_picture *p = &report->in.results->surface_picture[i];
    struct proxy_request request = {.scene = q->input.scene.fibers,
                                    .configuration = q->configuration,
                                    .look = look,
                                    .width = q->width,
                                    .height = q->height,
                                    .n_side = 1,
                                    .way = (enum ray_filter_way)p->preview_filter,
                                    .seed = q->seed,
                                    .stream = q->stream};
    struct image im;
    const double before_s = process_use().cpu_s;
    while (request.n_side < RAY_MAX_SIDE && request.n_side * request.n_side < q->n_sample) request.n_side++;
    status s = proxy_picture_render(&request, report->in.job->tools->pool, progress, &im, err);
    if (s != STATUS_OK) return s;
    memcpy(so_far->image.pixel, im.pixel, im.width * im.height * im.n_channel * sizeof *im.pixel);
    so_far->n_sample = q->n_sample;
    image_release(&im);
    log_info(report->in.job->tools->log, "preview: %zu x %zu rays a pixel, processor %.2f s", request.n_side,
             request.n_side, process_use().cpu_s - before_s);
    return STATUS_OK;
}
