#include "optimizer/report/surface/surface_filter.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/job/document/json_number.h"
#include "optimizer/report/result/result_pictures.h"

#include <stdio.h>
#include <string.h>

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
    struct progress silent = progress_silent(progress);
    return render_guides_make(q, tables->averaged ? &tables->averages : NULL, report->in.job->tools->pool, &silent,
                              &filter->guides, err);
}

void surface_filter_release(struct surface_filter *filter) { render_guides_release(&filter->guides); }

bool surface_filter_can(const struct surface_filter *filter, const struct surface_passes *so_far)
{
    return filter->guides.feature.pixel != NULL && so_far->n_first < so_far->n_sample;
}

status surface_filter_view(const struct report *report, const struct surface_filter *filter,
                           const struct surface_passes *so_far, struct image *out, double *error, struct error *err)
{
    struct image half[2];
    struct progress silent = progress_silent(&report->in.job->tools->progress);
    status s = surface_passes_halves(so_far, half, err);
    if (s != STATUS_OK) return s;
    s = render_guides_filter(&filter->guides, half, report->in.job->tools->pool, &silent, out, error, err);
    image_release(&half[0]);
    image_release(&half[1]);
    return s;
}

status surface_filter_write(const struct report *report, const struct surface_filter *filter,
                            const struct surface_ground *ground, const struct surface_passes *so_far, double exposure,
                            json_t **entry, struct error *err)
{
    char name[64], file[80];
    struct image out;
    double error;
    *entry = NULL;
    if (!surface_filter_can(filter, so_far)) return STATUS_OK;
    status s = surface_filter_view(report, filter, so_far, &out, &error, err);
    if (s != STATUS_OK) return s;
    surface_ground_add_filtered(ground, &out);
    snprintf(name, sizeof name, "%s-filtered", so_far->name);
    s = result_image_write(report, &out, "pictures", name, exposure, true, err);
    image_release(&out);
    if (s != STATUS_OK) return s;
    snprintf(file, sizeof file, "pictures/%s.png", name);
    *entry = json_pack("{s:s, s:s, s:o}", "file", file, "filter",
                       ground->present && ground->sheared ? JOINT_FILTER_ID "+sheared.v1" : JOINT_FILTER_ID, "error",
                       json_number(error));
    return *entry != NULL ? STATUS_OK : error_set(err, STATUS_NO_MEMORY, "cannot write '%s': out of memory", file);
}
