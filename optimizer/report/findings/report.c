#include "optimizer/report/findings/report.h"
#include "optimizer/stages/scene/pipeline_volume.h"
#include "optimizer/stages/validation/pipeline_choice.h"

size_t report_best_model(const struct report *report) { return pipeline_best_model(report->model, report->n_model); }

status report_need_volume(struct report *report, struct error *err)
{
    if (report->volume.volume.density != NULL) return STATUS_OK;
    return volume_checkpoint_read(report->in.job->tools, &report->volume, err);
}
