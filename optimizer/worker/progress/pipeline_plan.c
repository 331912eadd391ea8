#include "optimizer/worker/progress/pipeline_plan.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/worker/report/result_pictures.h"
#include "optimizer/worker/stages/fit/pipeline_correction.h"
#include "optimizer/worker/stages/result/pipeline_validation.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

/* Seconds that a unit takes on one thread of a common processor of 2020, for a machine that has run no job yet. */
static const double read_s_per_voxel = 3e-8, orientation_s_per_voxel = 1.2e-6, fibers_s_per_voxel = 1.6e-6,
                    transfer_s_per_voxel = 1e-7, fit_s_per_path = 7e-6;
/* Of a fit with the budget of its method, the share of the paths that it takes in the mean. */
static const double usual_budget_share = 0.8, usual_budget = 6e6;
static const double report_s_per_voxel = 2e-7, least_s = 0.05;

/* Voxels of the scan: as read, or by the size of its files, which have one or two bytes a voxel. */
static double n_voxel(const struct pipeline_context *c)
{
    double n = (double)c->geometry.n[0] * (double)c->geometry.n[1] * (double)c->geometry.n[2];
    for (size_t i = 0; i < c->doc->n_volume_file && !(c->geometry.n[0] > 0); i++) {
        char path[WORKER_PATH_BYTES];
        struct stat file;
        worker_folder_path(c->folder, JOB_FOLDER_INPUT, c->doc->volume_file[i], path);
        if (stat(path, &file) == 0) n += (double)file.st_size / 1.5;
    }
    return fmax(n, 1.0);
}

static double n_thread(const struct pipeline_context *c) { return (double)thread_pool_n_thread(c->pool); }

/* A stage that goes through the voxels. */
static void plan_voxels(struct pipeline_context *c, size_t i, const char *key, double s_per_voxel)
{
    worker_status_plan(c->status, i, key, n_voxel(c) / n_thread(c), s_per_voxel);
}

/* ---- the fit and what follows it ---- */

/* What the fit consists of besides a plain one, which makes its time per path of the budget another. */
static const char *kind_of_fit(const struct pipeline_context *c)
{
    if (c->number.n > 0) return pipeline_correction_applies(c) ? "+correction" : "+cloth";
    if (c->doc->fit_radius) return "+radius";
    return c->doc->has_volume ? "+scan" : "";
}

static void plan_fit(struct pipeline_context *c, size_t i)
{
    char key[SPEED_BOOK_KEY_BYTES];
    const struct method_info *method = method_catalogue_find(c->doc->method);
    double budget = c->doc->path_budget > 0                             ? (double)c->doc->path_budget
                    : method != NULL && method->default_path_budget > 0 ? (double)method->default_path_budget
                                                                        : usual_budget;
    snprintf(key, sizeof key, "fit.%.40s%s", c->doc->method, kind_of_fit(c));
    worker_status_plan(c->status, i, key, budget * (double)c->n_model / n_thread(c),
                       fit_s_per_path * usual_budget_share);
}

/* Seconds that a path has taken in this job's fits; NaN before them. */
static double s_per_path(const struct pipeline_context *c)
{
    double n = 0.0, s = 0.0;
    for (size_t i = 0; i < c->n_model; i++) {
        n += (double)c->model[i].fit.n_path;
        s += c->model[i].fit.wall_s;
    }
    return n > 0.0 ? s / n : NAN;
}

/* A stage after the fit, stage i_fit: n_path paths, or, before the fit has ended, a share of the fit's time. */
static void plan_after_fit(struct pipeline_context *c, size_t i, size_t i_fit, double n_path, double share)
{
    static const char *const key[] = {"validation", "report"};
    const double path_s = s_per_path(c);
    if (isfinite(path_s))
        worker_status_plan_own(c->status, i, key[i - i_fit - 1], fmax(n_path * path_s, least_s));
    else
        worker_status_plan_share(c->status, i, key[i - i_fit - 1], share, i_fit);
}

/* Paths of all renderings together. */
static double picture_paths(const struct pipeline_context *c)
{
    const double px = (double)c->doc->render_px;
    return px * px * (double)c->observation.n * (double)result_picture_samples(c);
}

static void plan_report(struct pipeline_context *c, size_t i)
{
    if (job_document_geometry_only(c->doc))
        plan_voxels(c, i, "report.geometry", report_s_per_voxel);
    else
        plan_after_fit(c, i, i - 2, picture_paths(c), 0.5);
}

void pipeline_plan_stage(struct pipeline_context *c, const char *name, size_t i)
{
    if (strcmp(name, "volume") == 0)
        plan_voxels(c, i, "volume", read_s_per_voxel);
    else if (strcmp(name, "orientation") == 0)
        plan_voxels(c, i, "orientation", orientation_s_per_voxel);
    else if (strcmp(name, "fibers") == 0 && c->doc->has_volume)
        plan_voxels(c, i, "fibers", fibers_s_per_voxel);
    else if (strcmp(name, "directions") == 0)
        plan_voxels(c, i, "directions", transfer_s_per_voxel);
    else if (strcmp(name, "fit") == 0)
        plan_fit(c, i);
    else if (strcmp(name, "validation") == 0)
        plan_after_fit(c, i, i - 1, pipeline_validation_paths(c), 0.4);
    else if (strcmp(name, "report") == 0)
        plan_report(c, i);
    else
        worker_status_plan(c->status, i, name, 1.0, least_s);
}
