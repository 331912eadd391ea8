#include "optimizer/report/surface/surface_filter.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/report/result/result_pictures.h"
#include "renderer/preview/feature_image.h"
#include "renderer/preview/joint_filter.h"

#include <stdio.h>
#include <string.h>

enum { FEATURE_SAMPLES = 8 };

status surface_filter_init(const struct report *report, size_t i, const struct render_request *q,
                           const struct surface_tables *tables, const struct progress *progress,
                           struct surface_filter *filter, struct error *err)
{
    memset(filter, 0, sizeof *filter);
    if (!report->in.results->surface_picture[i].filter) return STATUS_OK;
    if (q->input.scene.fibers == NULL) {
        worker_status_warn(report->in.job->tools->status,
                           "picture %zu is not filtered: a volume model has no fibers to look at", i + 1);
        return STATUS_OK;
    }
    const struct feature_request f = {.scene = q->input.scene.fibers,
                                      .averages = tables->averaged ? &tables->averages : NULL,
                                      .configuration = q->configuration,
                                      .width = q->width,
                                      .height = q->height,
                                      .n_sample = FEATURE_SAMPLES,
                                      .seed = q->seed};
    struct progress silent = progress_silent(progress);
    return feature_image_render(&f, report->in.job->tools->pool, &silent, &filter->feature, err);
}

void surface_filter_release(struct surface_filter *filter) { image_release(&filter->feature); }

status surface_filter_write(const struct report *report, const struct surface_filter *filter,
                            const struct surface_ground *ground, const struct surface_passes *so_far, double exposure,
                            json_t **entry, struct error *err)
{
    char name[64], file[80];
    struct image out;
    *entry = NULL;
    if (filter->feature.pixel == NULL) return STATUS_OK;
    struct progress silent = progress_silent(&report->in.job->tools->progress);
    status s = joint_filter(&so_far->image, &filter->feature, report->in.job->tools->pool, &silent, &out, err);
    if (s != STATUS_OK) return s;
    surface_ground_add_filtered(ground, &out);
    snprintf(name, sizeof name, "%s-filtered", so_far->name);
    s = result_image_write(report, &out, "pictures", name, exposure, false, err);
    image_release(&out);
    if (s != STATUS_OK) return s;
    snprintf(file, sizeof file, "pictures/%s.png", name);
    *entry = json_pack("{s:s, s:s}", "file", file, "filter",
                       ground->present && ground->sheared ? "joint.v1+sheared.v1" : "joint.v1");
    return *entry != NULL ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot write '%s': out of memory", file);
}
