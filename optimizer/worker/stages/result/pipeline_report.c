/* Stage "report": everything under results/. The numbers are written first, so that they can be looked at while
 * pictures are rendered. */
#include "optimizer/worker/pipeline_context.h"
#include "optimizer/worker/report/cloth/quality.h"
#include "optimizer/worker/report/result_json.h"
#include "optimizer/worker/report/result_pictures.h"
#include "optimizer/worker/stages/fit/pipeline_cloth.h"
#include "optimizer/worker/stages/result/pipeline_advice.h"
#include "optimizer/worker/stages/result/pipeline_choice.h"
#include "optimizer/worker/stages/result/pipeline_skill.h"

/* Of a job that ends with the geometry. */
static status report_geometry(struct pipeline_context *c, struct error *err)
{
    reconstruct_warn_fibers(&c->geometry, &c->fiber, &(struct warning_sink){pipeline_warn, c});
    status s = result_geometry_json_write(c, err);
    if (s == STATUS_OK) s = result_summary_write(c, err);
    if (s == STATUS_OK) s = result_geometry_write(c, err);
    return s == STATUS_OK ? quality_write(c, err) : s;
}

status stage_report(struct pipeline_context *c, struct error *err)
{
    if (job_document_geometry_only(c->doc)) return report_geometry(c, err);
    status s = pipeline_certify(c, err);
    if (s == STATUS_OK) s = pipeline_rank_candidates(c, err);
    if (s == STATUS_OK) s = pipeline_measure_skill(c, err);
    if (s == STATUS_OK) s = pipeline_cloth_use(c, pipeline_best_model(c), err);
    if (s == STATUS_OK) s = result_json_write(c, err);
    if (s == STATUS_OK) s = result_summary_write(c, err);
    if (s == STATUS_OK) s = result_geometry_write(c, err);
    if (s == STATUS_OK) s = quality_write(c, err);
    if (s == STATUS_OK) s = result_renderings_write(c, 0.1, err);
    if (s == STATUS_OK) s = result_json_write(c, err);
    return s;
}
