/* The work of the stage "report", part by part. The plan of a job takes the sum (optimizer/worker/pipeline_plan.h), and
 * the stage itself divides its progress by the same numbers, so that forecast and progress agree. */
#ifndef SELVEDGE_OPTIMIZER_REPORT_WORK_H
#define SELVEDGE_OPTIMIZER_REPORT_WORK_H

#include "optimizer/job/document/job_sections.h"

/* In the order in which a job does them; a kind of job leaves parts out. */
enum report_part {
    REPORT_FINDINGS,   /* certificates, candidates for the next photograph, the plain BRDF, the verdict */
    REPORT_GEOMETRY,   /* files of fibers and voxels, slices, quality.html */
    REPORT_RENDERINGS, /* of every row */
    REPORT_SURFACES,   /* pictures on surfaces, with their tables */
    REPORT_TWIN,
    REPORT_EXPORTS, /* scenes and textures for other programs */
    REPORT_PAGES,   /* result.json, report.html, report.pdf */
    REPORT_N_PART
};

struct report_work_input {
    enum job_kind kind;
    const struct job_results *results;
    size_t n_row, n_candidate;
    double n_fit_path;           /* paths of the best model's fit */
    double n_fit_path_of_models; /* of the fits of all models */
    double path_s;               /* elapsed time of one path of a photograph, on all threads */
    double n_thread, n_voxel, n_segment;
    double certificate_s; /* on one thread */
};

/* Sets the elapsed seconds that each part is expected to take; 0 for a part that the job has not. */
void report_work(const struct report_work_input *in, double part_s[REPORT_N_PART]);
double report_work_sum(const double part_s[REPORT_N_PART]);
/* Returns the progress of the stage, in [0, 1], when the parts before `part` are done; 1 for REPORT_N_PART. */
double report_work_before(const double part_s[REPORT_N_PART], enum report_part part);
/* Writes which of the parts whose time varies most the job has, such as "+pictures+twin": jobs with the same text
 * remember how far off their forecasts were. */
void report_work_kind(const struct report_work_input *in, char *text, size_t n_byte);

#endif
