#include "optimizer/report/findings/report.h"
#include "optimizer/stages/scene/pipeline_volume.h"
#include "optimizer/stages/validation/pipeline_choice.h"

static size_t best_profile(const struct report *report)
{
    size_t best = 0;
    for (size_t i = 1; i < report->n_model; i++)
        if (report->model[i].fit->profile.bic < report->model[best].fit->profile.bic) best = i;
    return best;
}

size_t report_best_model(const struct report *report)
{
    return report->in.kind == JOB_OF_PROFILE ? best_profile(report)
                                             : pipeline_best_model(report->model, report->n_model);
}

status report_need_volume(struct report *report, struct error *err)
{
    if (report->volume.volume.density != NULL) return STATUS_OK;
    return volume_checkpoint_read(report->in.job->tools, &report->volume, err);
}
