/* Stage "report": everything under results/. The numbers are written first, so that they can be looked at while
 * pictures are rendered. */
#include "base/option_id.h"
#include "optimizer/job/options/option_key.h"
#include "optimizer/worker/pipeline_context.h"
#include "optimizer/worker/report/cloth/quality.h"
#include "optimizer/worker/report/export/exports.h"
#include "optimizer/worker/report/page/report_page.h"
#include "optimizer/worker/report/page/report_pdf.h"
#include "optimizer/worker/report/result_json.h"
#include "optimizer/worker/report/result_pictures.h"
#include "optimizer/worker/report/surface/surface_pictures.h"
#include "optimizer/worker/report/twin/twin_result.h"
#include "optimizer/worker/stages/fit/pipeline_cloth.h"
#include "optimizer/worker/stages/result/pipeline_advice.h"
#include "optimizer/worker/stages/result/pipeline_choice.h"
#include "optimizer/worker/stages/result/pipeline_pairing.h"
#include "optimizer/worker/stages/result/pipeline_skill.h"
#include "optimizer/worker/stages/result/pipeline_verdict.h"

/* Depth by which fibers run into each other, over their diameter and as a mean over all points, above which a described
 * cloth has more fiber than fits. Default numbers make 0 to 0.07; a packing of 0.85 makes 0.14. */
static const double most_overlap = 0.1;

static void warn_of_overlap(const struct pipeline_context *c)
{
    if (c->doc->cloth.description == NULL || !(c->cloth.overlap_mean > most_overlap)) return;
    worker_status_warn(
        c->status,
        "'%s' asks for more fiber than fits: its fibers run into each other by %.0f %% of their diameter "
        "on average; lower packing or cover, or raise compression",
        job_option_key(OPTION_CLOTH), 100.0 * c->cloth.overlap_mean);
}

/* Of a job that ends with the geometry. */
static status report_geometry(struct pipeline_context *c, struct error *err)
{
    reconstruct_warn_fibers(&c->geometry, &c->fiber, &(struct warning_sink){pipeline_warn, c});
    report_pdf_warn(c);
    pipeline_reach_verdict(c);
    status s = result_geometry_json_write(c, err);
    if (s == STATUS_OK) s = result_summary_write(c, err);
    if (s == STATUS_OK) s = result_geometry_write(c, err);
    if (s == STATUS_OK) s = quality_write(c, err);
    if (s == STATUS_OK) s = report_write(c, err);
    return s == STATUS_OK ? report_pdf_write(c, err) : s;
}

/* Of a job that renders given parameters. */
static status report_pictures(struct pipeline_context *c, struct error *err)
{
    warn_of_overlap(c);
    report_pdf_warn(c);
    status s = result_geometry_write(c, err);
    if (s == STATUS_OK) s = quality_write(c, err);
    double on_surfaces = surface_pictures_paths(c), until = on_surfaces / (on_surfaces + twin_result_paths(c));
    if (s == STATUS_OK) s = surface_pictures_write(c, 0.0, until, err);
    if (s == STATUS_OK) s = twin_result_write(c, until, 1.0, err);
    if (s == STATUS_OK) pipeline_reach_verdict(c);
    if (s == STATUS_OK) s = result_pictures_json_write(c, err);
    if (s == STATUS_OK) s = result_summary_write(c, err);
    if (s == STATUS_OK) s = report_write(c, err);
    return s == STATUS_OK ? report_pdf_write(c, err) : s;
}

status stage_report(struct pipeline_context *c, struct error *err)
{
    if (job_document_kind(c->doc) == JOB_OF_GEOMETRY) return report_geometry(c, err);
    if (job_document_kind(c->doc) == JOB_OF_PICTURES) return report_pictures(c, err);
    status s = pipeline_certify(c, err);
    if (s == STATUS_OK) s = pipeline_rank_candidates(c, err);
    if (s == STATUS_OK) s = pipeline_measure_skill(c, err);
    if (s == STATUS_OK) s = pipeline_cloth_use(c, pipeline_best_model(c), err);
    if (s == STATUS_OK) s = pipeline_warn_pairing(c, err);
    if (s == STATUS_OK) warn_of_overlap(c);
    if (s == STATUS_OK) report_pdf_warn(c);
    if (s == STATUS_OK) pipeline_reach_verdict(c);
    if (s == STATUS_OK) s = result_json_write(c, err);
    if (s == STATUS_OK) s = result_summary_write(c, err);
    if (s == STATUS_OK) s = result_geometry_write(c, err);
    if (s == STATUS_OK) s = quality_write(c, err);
    double n_fit_path = (double)c->model[pipeline_best_model(c)].fit.n_path;
    double done = result_renderings_paths(c, n_fit_path), on_surfaces = done + surface_pictures_paths(c),
           all = on_surfaces + twin_result_paths(c), first = 0.1, rest = all > 0.0 ? (1.0 - first) / all : 0.0;
    if (s == STATUS_OK) s = result_renderings_write(c, first, first + rest * done, err);
    if (s == STATUS_OK) s = surface_pictures_write(c, first + rest * done, first + rest * on_surfaces, err);
    if (s == STATUS_OK) s = twin_result_write(c, first + rest * on_surfaces, 1.0, err);
    if (s == STATUS_OK) s = exports_write(c, err);
    if (s == STATUS_OK) s = result_json_write(c, err);
    if (s == STATUS_OK) s = report_write(c, err);
    return s == STATUS_OK ? report_pdf_write(c, err) : s;
}
