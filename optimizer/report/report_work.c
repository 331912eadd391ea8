#include "optimizer/report/report_work.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/report/export/exports.h"
#include "optimizer/report/export/twin_result.h"
#include "optimizer/report/result/result_pictures.h"
#include "optimizer/report/surface/surface_pictures.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Processor seconds on a common processor of 2023: of the pages, and of report.pdf by WeasyPrint; of a voxel, whose
 * density and directions are written; of a segment in fibers.hair and fibers.txt. */
static const double page_s = 0.1, pdf_s = 3.0, voxel_s = 8e-8, segment_s = 2.2e-6;
/* Share of the paths of a fit that all candidates for the next photograph take (pipeline_candidates.c). */
static const double candidate_share = 0.5;

void report_work(const struct report_work_input *in, double part_s[REPORT_N_PART])
{
    const bool renders = in->kind == JOB_OF_FIT || in->kind == JOB_OF_PICTURES;
    memset(part_s, 0, REPORT_N_PART * sizeof *part_s);
    part_s[REPORT_PAGES] = page_s + (in->results->export_pdf ? pdf_s : 0.0);
    if (in->kind == JOB_OF_PROFILE) return;
    part_s[REPORT_GEOMETRY] = voxel_s * in->n_voxel / in->n_thread + segment_s * in->n_segment;
    if (!renders) return;
    part_s[REPORT_SURFACES] = in->path_s * surface_pictures_paths(in->results);
    part_s[REPORT_TWIN] = in->path_s * twin_result_paths(in->results);
    part_s[REPORT_EXPORTS] = in->path_s * exports_paths(in->results, in->n_row, in->n_fit_path) +
                             segment_s * in->n_segment * (double)exports_count(in->results);
    if (in->kind != JOB_OF_FIT) return;
    part_s[REPORT_FINDINGS] = page_s + in->certificate_s +
                              (in->n_candidate > 0 ? candidate_share * in->path_s * in->n_fit_path_of_models : 0.0);
    part_s[REPORT_RENDERINGS] = in->path_s * result_renderings_paths(in->results, in->n_row, in->n_fit_path);
}

double report_work_sum(const double part_s[REPORT_N_PART])
{
    double sum = 0.0;
    for (size_t i = 0; i < REPORT_N_PART; i++) sum += part_s[i];
    return sum;
}

double report_work_before(const double part_s[REPORT_N_PART], enum report_part part)
{
    const double all = report_work_sum(part_s);
    double before = 0.0;
    if (part == REPORT_N_PART || !(all > 0.0)) return part == REPORT_N_PART ? 1.0 : 0.0;
    for (size_t i = 0; i < (size_t)part; i++) before += part_s[i];
    return fmin(before / all, 1.0);
}

void report_work_kind(const struct report_work_input *in, char *text, size_t n_byte)
{
    const struct job_results *r = in->results;
    snprintf(text, n_byte, "%s%s%s%s", r->n_surface_picture > 0 ? "+pictures" : "", r->twin ? "+twin" : "",
             exports_count(r) > 0 ? "+exports" : "", r->export_pdf ? "+pdf" : "");
}
