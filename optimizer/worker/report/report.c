#include "optimizer/worker/report/report.h"
#include "optimizer/worker/stages/result/pipeline_choice.h"
#include "optimizer/worker/stages/scene/pipeline_volume.h"

size_t report_best_model(const struct report *report) { return pipeline_best_model(report->model, report->n_model); }

status report_need_volume(struct report *report, struct error *err)
{
    if (report->volume.volume.density != NULL) return STATUS_OK;
    return volume_checkpoint_read(report->in.job->tools, &report->volume, err);
}
