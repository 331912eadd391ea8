/* Stage "report": everything under results/. The numbers are written first, so that they can be looked at while
 * pictures are rendered. */
#include "base/clock.h"
#include "base/option_id.h"
#include "base/process.h"
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/job/options/option_key.h"
#include "optimizer/report/export/exports.h"
#include "optimizer/report/export/twin_result.h"
#include "optimizer/report/findings/findings.h"
#include "optimizer/report/findings/report.h"
#include "optimizer/report/quality.h"
#include "optimizer/report/report_page.h"
#include "optimizer/report/report_pdf.h"
#include "optimizer/report/report_work.h"
#include "optimizer/report/result/profile_report.h"
#include "optimizer/report/result/result_json.h"
#include "optimizer/report/result/result_pictures.h"
#include "optimizer/report/result/table_lobes.h"
#include "optimizer/report/surface/surface_pictures.h"
#include "optimizer/stages/fit/pipeline_cloth.h"
#include "optimizer/stages/validation/pipeline_choice.h"

#include <stdlib.h>
#include <unistd.h>

/* What is made after the result: 90 s of two cores on the demo, the draft within 20 s. */
enum {
    DRAFT_PX = 256,
    DRAFT_SAMPLES = 4,
    DRAFT_PATHS = 100000,
    HERO_PX = 640,
    HERO_SAMPLES = 12,
    HERO_PATHS = 2000000,
    TWIN_PATHS = 800000
};

/* Depth by which fibers run into each other, over their diameter and as a mean over all points, above which a described
 * cloth has more fiber than fits. Default numbers make 0 to 0.07; a packing of 0.85 makes 0.14. */
static const double most_overlap = 0.1;

static void warn_of_overlap(const struct report *report)
{
    if (report->in.job->cloth->description == NULL || !(report->in.made->report.overlap_mean > most_overlap)) return;
    worker_status_warn(
        report->in.job->tools->status,
        "'%s' asks for more fiber than fits: its fibers run into each other by %.0f %% of their diameter "
        "on average; lower packing or cover, or raise compression",
        job_option_key(OPTION_CLOTH), 100.0 * report->in.made->report.overlap_mean);
}

/* ---- parts, whose ends are steps of the stage's progress and lines of the log ---- */

static double before(const struct report *report, enum report_part part)
{
    return report_work_before(report->in.work_s, part);
}

static double after(const struct report *report, enum report_part part) { return before(report, part + 1); }

/* Ends a part, in which s was returned. Returns s. */
static status done(struct report *report, enum report_part part, const char *name, status s)
{
    const double now_s = clock_monotonic_s(), cpu_s = process_use().cpu_s;
    if (s != STATUS_OK) return s;
    progress_report(&report->in.job->tools->progress, after(report, part));
    log_info(report->in.job->tools->log, "report, %s: %.2f s, processor %.2f s, expected %.2f s", name,
             now_s - report->part_from_s, cpu_s - report->part_from_cpu_s, report->in.work_s[part]);
    report->part_from_s = now_s;
    report->part_from_cpu_s = cpu_s;
    return STATUS_OK;
}

static status write_geometry(struct report *report, struct error *err)
{
    status s = result_geometry_write(report, err);
    if (s == STATUS_OK) s = quality_write(report, err);
    return done(report, REPORT_GEOMETRY, "geometry", s);
}

static status write_renderings(struct report *report, struct error *err)
{
    const double from = before(report, REPORT_RENDERINGS), to = after(report, REPORT_RENDERINGS);
    status s = report->in.photographs->n_photograph > 0 ? result_renderings_write(report, from, to, err)
                                                        : table_lobes_write(report, from, to, err);
    return done(report, REPORT_RENDERINGS, "renderings", s);
}

static status write_surfaces(struct report *report, struct error *err)
{
    status s = surface_pictures_write(report, before(report, REPORT_SURFACES), after(report, REPORT_SURFACES), err);
    return done(report, REPORT_SURFACES, "pictures", s);
}

static status write_twin(struct report *report, struct error *err)
{
    status s = twin_result_write(report, before(report, REPORT_TWIN), after(report, REPORT_TWIN), err);
    return done(report, REPORT_TWIN, "twin", s);
}

static status write_exports(struct report *report, struct error *err)
{
    status s = exports_write(report, before(report, REPORT_EXPORTS), after(report, REPORT_EXPORTS), err);
    return done(report, REPORT_EXPORTS, "exports", s);
}

static status write_pages(struct report *report, struct error *err)
{
    status s = report_write(report, err);
    if (s == STATUS_OK) s = report_pdf_write(report, err);
    return done(report, REPORT_PAGES, "pages", s);
}

/* Writes the results of a job that ends with the geometry. */
static status report_geometry(struct report *report, struct error *err)
{
    reconstruct_warn_fibers(&report->in.made->geometry, &report->in.made->fiber, &report->in.job->tools->warn);
    report_pdf_warn(report);
    pipeline_reach_verdict(report);
    status s = result_geometry_json_write(report, err);
    if (s == STATUS_OK) s = result_summary_write(report, err);
    if (s == STATUS_OK) s = write_geometry(report, err);
    return s == STATUS_OK ? write_pages(report, err) : s;
}

/* Writes the results of a job that renders given parameters. */
static status report_pictures(struct report *report, struct error *err)
{
    warn_of_overlap(report);
    report_pdf_warn(report);
    status s = write_geometry(report, err);
    if (s == STATUS_OK) s = write_surfaces(report, err);
    if (s == STATUS_OK) s = write_twin(report, err);
    if (s == STATUS_OK) s = write_exports(report, err);
    if (s == STATUS_OK) pipeline_reach_verdict(report);
    if (s == STATUS_OK) s = result_pictures_json_write(report, err);
    if (s == STATUS_OK) s = result_summary_write(report, err);
    return s == STATUS_OK ? write_pages(report, err) : s;
}

/* Writes the results of a job with the profile of a single fiber. */
static status report_profile(struct report *report, struct error *err)
{
    pipeline_reach_verdict(report);
    status s = profile_json_write(report, err);
    if (s == STATUS_OK) s = result_summary_write(report, err);
    if (s == STATUS_OK) s = profile_csv_write(report, err);
    return s == STATUS_OK ? report_write(report, err) : s;
}

static status use_best(struct report *report, struct error *err)
{
    const size_t best = report_best_model(report);
    return pipeline_cloth_use(report->in.job, &report->in.fit[best], best, report->in.made, err);
}

static status find(struct report *report, struct error *err)
{
    status s = pipeline_certify(report, err);
    if (s == STATUS_OK) s = pipeline_rank_candidates(report, err);
    if (s == STATUS_OK) s = pipeline_measure_skill(report, err);
    if (s == STATUS_OK) s = use_best(report, err);
    if (s == STATUS_OK) s = pipeline_warn_pairing(report, err);
    if (s == STATUS_OK) warn_of_overlap(report);
    if (s == STATUS_OK) report_pdf_warn(report);
    if (s == STATUS_OK) pipeline_reach_verdict(report);
    if (s == STATUS_OK) s = result_json_write(report, err);
    if (s == STATUS_OK) s = result_summary_write(report, err);
    return done(report, REPORT_FINDINGS, "findings", s);
}

/* Writes the results of a job that fits models to rows. */
static status report_fit(struct report *report, struct error *err)
{
    status s = find(report, err);
    if (s == STATUS_OK) s = write_geometry(report, err);
    if (s == STATUS_OK) s = write_renderings(report, err);
    if (s == STATUS_OK) s = write_surfaces(report, err);
    if (s == STATUS_OK) s = write_twin(report, err);
    if (s == STATUS_OK) s = write_exports(report, err);
    if (s == STATUS_OK) s = result_json_write(report, err);
    if (s == STATUS_OK && json_array_size(report->exports) > 0) s = result_summary_write(report, err);
    return s == STATUS_OK ? write_pages(report, err) : s;
}

static status run(struct report *report, struct error *err)
{
    switch (report->in.kind) {
    case JOB_OF_GEOMETRY:
        return report_geometry(report, err);
    case JOB_OF_PICTURES:
        return report_pictures(report, err);
    case JOB_OF_PROFILE:
        return report_profile(report, err);
    default:
        return report_fit(report, err);
    }
}

static void report_release(struct report *report)
{
    for (size_t i = 0; i < report->n_model; i++) free(report->advice[i].candidate);
    free(report->advice);
    json_decref(report->exports);
    json_decref(report->surface_pictures);
    volume_release(&report->volume.volume);
    free(report);
}

/* *out: to be freed by report_release. STATUS_NO_MEMORY. */
static status report_new(const struct report_input *in, struct report **out, struct error *err)
{
    const size_t n_model = in->job->n_model;
    struct report *report = calloc(1, sizeof *report);
    struct model_advice *advice = calloc(n_model + 1, sizeof *advice);
    if (report == NULL || advice == NULL) {
        free(report);
        free(advice);
        return error_set(err, STATUS_NO_MEMORY, "cannot write the results: out of memory");
    }
    report->in = *in;
    report->n_model = n_model;
    report->part_from_s = clock_monotonic_s();
    report->part_from_cpu_s = process_use().cpu_s;
    report->exports = json_array();
    report->surface_pictures = json_array();
    report->advice = advice;
    for (size_t i = 0; i < n_model; i++)
        report->model[i] = (struct pipeline_model){.setup = &in->job->model[i],
                                                   .fit = in->fit != NULL ? &in->fit[i] : NULL,
                                                   .validation = in->validation != NULL ? &in->validation[i] : NULL,
                                                   .advice = &report->advice[i]};
    *out = report;
    return STATUS_OK;
}

status stage_report(const struct report_input *in, struct report_output *out, struct error *err)
{
    struct report *report;
    status s = report_new(in, &report, err);
    if (s != STATUS_OK) return s;
    s = run(report, err);
    out->verdict = report->verdict;
    report_release(report);
    return s;
}

/* The picture in the studio; draft: of few pixels, samples and paths of tables. */
static status write_hero(struct report *report, bool draft, double from, double to, struct error *err)
{
    struct job_results results = *report->in.results;
    struct job_surface_picture hero;
    char path[WORKER_PATH_BYTES];
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, "pictures/hero.png", path);
    if (draft && access(path, F_OK) == 0) return STATUS_OK;
    job_picture_studio(JOB_KIND_DRAPE, &hero);
    hero.name = "hero";
    hero.is_draft = draft;
    hero.px = draft ? DRAFT_PX : HERO_PX;
    hero.sample = draft ? DRAFT_SAMPLES : HERO_SAMPLES;
    hero.n_deep_path = draft ? DRAFT_PATHS : HERO_PATHS;
    results.n_surface_picture = 1;
    results.surface_picture = &hero;
    const struct job_results *own = report->in.results;
    report->in.results = &results;
    status s = surface_pictures_write(report, from, to, err);
    report->in.results = own;
    return s;
}

static status write_default_twin(struct report *report, double from, double to, struct error *err)
{
    struct job_results results = *report->in.results;
    const struct job_results *own = report->in.results;
    if (own->twin) return STATUS_OK;
    results.twin = true;
    results.twin_paths = TWIN_PATHS;
    report->in.results = &results;
    status s = twin_result_write(report, from, to, err);
    report->in.results = own;
    return s;
}

status stage_pictures(const struct report_input *in, struct error *err)
{
    struct report *report;
    status s = report_new(in, &report, err);
    if (s != STATUS_OK) return s;
    bool studio = false;
    for (size_t i = 0; i < in->results->n_surface_picture; i++)
        studio = studio || in->results->surface_picture[i].kind != JOB_KIND_MEASUREMENT;
    if (in->kind == JOB_OF_FIT) s = use_best(report, err);
    if (s == STATUS_OK && !studio) s = write_hero(report, true, 0.0, 0.1, err);
    if (s == STATUS_OK) s = write_default_twin(report, 0.1, 0.5, err);
    if (s == STATUS_OK && !studio) s = write_hero(report, false, 0.5, 1.0, err);
    report_release(report);
    return s;
}
