#include "optimizer/worker/pipeline_plan.h"
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/job/document/job_scan.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/job/stage_table.h"
#include "optimizer/stages/fit/pipeline_correction.h"
#include "optimizer/stages/fit/pipeline_scan_error.h"
#include "optimizer/stages/validation/pipeline_choice.h"
#include "optimizer/stages/validation/pipeline_validation.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

/* Stages that go through voxels: seconds that one takes on one thread of a common processor of 2023, for a machine that
 * has run no job yet, the standard deviation of its logarithm between jobs, and how the time runs over the fraction:
 * means of the demo's scan, of two real ones and of a felt of 156 million voxels, which need up to 1.5 times more or
 * less. Filters vary more, because their cost goes with the size of the fibers in voxels. */
struct voxel_stage {
    const char *key;
    double s_per_voxel, log_sd;
    const double *curve;
};
/* A path of a picture: on three described weaves 3 to 17 us, by how bright and how closed the cloth is. */
static const double render_s_per_path = 8e-6;
static const double read_curve[SPEED_CURVE_POINTS] = {0.03, 0.05, 0.08, 0.10, 0.12, 0.40, 0.40, 0.94, 0.94, 0.94,
                                                      0.94, 0.94, 0.94, 0.94, 0.94, 0.94, 0.94, 0.94, 0.94, 0.94};
static const double hollow_curve[SPEED_CURVE_POINTS] = {0.00, 0.01, 0.01, 0.02, 0.02, 0.05, 0.05, 0.10, 0.18, 0.25,
                                                        0.33, 0.40, 0.48, 0.55, 0.63, 0.70, 0.78, 0.85, 0.93, 1.00};
static const double orientation_curve[SPEED_CURVE_POINTS] = {0.18, 0.29, 0.37, 0.38, 0.38, 0.40, 0.44,
                                                             0.48, 0.52, 0.55, 0.58, 0.62, 0.65, 0.68,
                                                             0.71, 0.74, 0.77, 0.82, 0.90, 0.97};
static const double fibers_curve[SPEED_CURVE_POINTS] = {0.10, 0.21, 0.27, 0.28, 0.37, 0.37, 0.47, 0.47, 0.52, 0.52,
                                                        0.66, 0.66, 0.66, 0.77, 0.80, 0.84, 0.88, 0.92, 0.95, 0.97};
static const double transfer_curve[SPEED_CURVE_POINTS] = {0.14, 0.18, 0.21, 0.24, 0.29, 0.33, 0.37, 0.41, 0.47, 0.52,
                                                          0.56, 0.61, 0.65, 0.69, 0.73, 0.75, 0.78, 0.81, 0.84, 0.85};
static const struct voxel_stage read_stage = {"volume", 1e-7, 0.8, read_curve},
                                hollow_stage = {"volume.hollow", 5e-6, 0.8, hollow_curve},
                                orientation_stage = {"orientation.material", 9e-7, 0.8, orientation_curve},
                                redirect_stage = {"orientation.noisy", 1.3e-5, 0.8, NULL},
                                fibers_stage = {"fibers.material", 6e-6, 0.4, fibers_curve},
                                trial_stage = {"fibers.trial", 6e-6, 0.4, NULL},
                                transfer_stage = {"directions.material", 4e-7, 0.8, transfer_curve};
/* The same of a path of a fit to rows whose brightest channel has the mean usual_radiance. In bright cloth paths are
 * longer: the time goes with this power of the radiance. */
static const double fit_s_per_path = 9e-6, usual_radiance = 0.13, radiance_power = 0.4;
/* Share of the voxels that is material, before the volume is known. */
static const double usual_material = 0.4;
/* Paths of a fitted row that a fit takes. A fit to a table ends by its misfit (tables of five fabrics took 0.7 to 1.3
 * million for 16 rows). A fit to photographs ends by their errors, which asks for 120 thousand effective paths of two
 * replicas. cloth_share: the share of the budget that a search of the numbers of a cloth takes. */
static const double misfit_row_paths = 62500.0, noise_row_paths = 264000.0, cloth_share = 0.7;
/* The fit's share of its stage's time where a scan's errors are carried on. */
static const double usual_budget = 6e6, fit_share = 1.0 - PIPELINE_SCAN_ERROR_SHARE;
/* Time of a validated path over the time of a fitted one. */
static const double validated_path = 0.88;
static const double least_s = 0.05;
/* The fit of a model to the profile of a fiber: its evaluations, the time of one for a row on one thread, and
 * preparations of the model over those that plan_probe.h counts for a certificate. Fits to 207 rows took 5 to 37
 * evaluations and up to 0.1 s, a fit of elliptical.v1 to 4,026 rows 5 s. */
static const double profile_evaluations = 40.0, s_per_profile_row = 3.3e-6, profile_certificates = 1.2,
                    sd_of_profile = 1.0;
/* Standard deviations of the logarithm of a time where no job has been run. */
static const double sd_of_fit = 0.5, sd_of_pictures = 0.7, sd_of_rest = 0.5;

/* By the size of the files one voxel has one or two bytes. */
double pipeline_plan_voxels(const struct job_plan *plan)
{
    double n = (double)plan->geometry.n[0] * (double)plan->geometry.n[1] * (double)plan->geometry.n[2];
    for (size_t i = 0; i < plan->in->section.scan->n_file && !(plan->geometry.n[0] > 0); i++) {
        char path[WORKER_PATH_BYTES];
        struct stat file;
        worker_folder_path(plan->tools->folder, JOB_FOLDER_INPUT, plan->in->section.scan->file[i], path);
        if (stat(path, &file) == 0) n += (double)file.st_size / 1.5;
    }
    return fmax(n, 1.0);
}

static double n_thread(const struct job_plan *plan) { return (double)thread_pool_n_thread(plan->tools->pool); }

/* A stage that goes through n voxels. */
static void plan_voxels(struct job_plan *plan, size_t i, const struct voxel_stage *stage, double n)
{
    const struct job_clock_work work = {.key = stage->key,
                                        .units = n / n_thread(plan),
                                        .usual_s = stage->s_per_voxel,
                                        .log_sd = stage->log_sd,
                                        .usual_curve = stage->curve};
    worker_status_plan(plan->status, i, &work);
}

/* Returns the voxels of material, where there are fibers to trace. */
static double n_material(const struct job_plan *plan)
{
    return plan->geometry.n_material_voxel > 0 ? (double)plan->geometry.n_material_voxel
                                               : usual_material * pipeline_plan_voxels(plan);
}

/* Tracing of the scan, and of its phantom of limited size where there is a trial. */
static void plan_fibers(struct job_plan *plan, size_t i)
{
    const double n = n_material(plan), n_trial = fmin(n, n / pipeline_plan_voxels(plan) * SCAN_TRIAL_VOXELS);
    if (plan->in->section.scan->trial)
        plan_voxels(plan, i, &trial_stage, n + n_trial);
    else
        plan_voxels(plan, i, &fibers_stage, n);
}

/* ---- a described cloth ---- */

/* Size of a felt's fiber, in units of the other structures; seconds of one thread for a unit: weaves of sizes from
 * 3,000 to 143,000 needed 1.5e-5 to 1.6e-5, felts of 600 and 2,500 fibers 1.2e-5 to 1.3e-5. */
static const double felt_fiber_size = 38.0, make_s_per_size = 1.5e-5;
/* Segments of a unit of that size; time of one thread for a segment that is read, or put into a scene. */
static const double segments_of_size = 2.4, s_per_segment = 1e-6, least_segments = 1e4;

static double fibers_of_yarn(const struct cloth_description *d, int direction, size_t i)
{
    const size_t k = d->n_order[direction] > 0 ? d->order[direction][i % d->n_order[direction]] : 0;
    return (double)d->kind[k].n_fiber;
}

double pipeline_plan_cloth_size(const struct job_plan *plan)
{
    const struct cloth_description *d = plan->in->section.cloth->description;
    double n_fiber[2] = {0.0, 0.0}, width[2] = {0.0, 0.0};
    if (d == NULL) return 0.0;
    const double times = plan->in->number.n > 0 && plan->in->section.cloth->final_tiles > 1
                             ? (double)plan->in->section.cloth->final_tiles
                             : 1.0;
    if (d->structure == CLOTH_FELT) return felt_fiber_size * (double)d->kind[0].n_fiber * times * times;
    for (int direction = CLOTH_WEFT; direction <= CLOTH_WARP; direction++)
        for (size_t i = 0; i < d->n_yarn[direction]; i++) {
            n_fiber[direction] += fibers_of_yarn(d, direction, i);
            width[direction] += sqrt(fibers_of_yarn(d, direction, i));
        }
    return (n_fiber[CLOTH_WEFT] * width[CLOTH_WARP] + n_fiber[CLOTH_WARP] * width[CLOTH_WEFT]) * times * times;
}

static void plan_cloth(struct job_plan *plan, size_t i)
{
    const struct job_clock_work work = {.key = "fibers.described",
                                        .units = pipeline_plan_cloth_size(plan) / n_thread(plan),
                                        .usual_s = make_s_per_size,
                                        .log_sd = sd_of_fit};
    worker_status_plan(plan->status, i, &work);
}

/* Segments of the fibers: as traced, or before by the size of a file of fibers or of the description. */
static double n_segment(const struct job_plan *plan)
{
    const double size = pipeline_plan_cloth_size(plan);
    if (plan->geometry.n_vertex > 0) return (double)plan->geometry.n_vertex;
    return size > 0.0 ? segments_of_size * size : plan->file_segments;
}

/* Reading a file of fibers, or building the scene: a stage of one thread that goes through all segments. */
static void plan_segments(struct job_plan *plan, size_t i, const char *name)
{
    const struct job_clock_work work = {
        .key = name, .units = fmax(n_segment(plan), least_segments), .usual_s = s_per_segment, .log_sd = sd_of_fit};
    worker_status_plan(plan->status, i, &work);
}

/* ---- the fit and the stages after it ---- */

/* Returns the suffix of the key for fits with further parts, whose time per path of the budget differs from a plain
 * fit's. */
static const char *kind_of_fit(const struct job_plan *plan)
{
    if (plan->in->number.n > 0)
        return pipeline_correction_applies(plan->in->section.cloth, &plan->in->number) ? "+correction" : "+cloth";
    if (plan->in->section.fit->fit_radius) return "+radius";
    return plan->in->section.scan->given ? "+scan" : "";
}

static double path_budget(const struct job_plan *plan)
{
    const struct method_info *method = method_catalogue_find(plan->in->section.fit->method);
    if (plan->in->section.fit->path_budget > 0) return (double)plan->in->section.fit->path_budget;
    return method != NULL && method->default_path_budget > 0 ? (double)method->default_path_budget : usual_budget;
}

double pipeline_plan_usual_paths(const struct job_plan *plan)
{
    const double budget = path_budget(plan);
    if (plan->in->number.n > 0) return cloth_share * budget;
    if (plan->in->section.rows->n_photograph > 0 && plan->in->section.fit->path_budget > 0)
        return budget; /* it is used up */
    return fmin((plan->in->section.rows->n_photograph > 0 ? noise_row_paths : misfit_row_paths) *
                    (double)plan->in->rows.fitted.n,
                budget);
}

/* Seconds that a path of the fit takes, by how bright its rows are and how thin the cloth is. */
static double usual_s_per_path(const struct job_plan *plan)
{
    double sum = 0.0, n = (double)plan->in->rows.fitted.n;
    for (size_t i = 0; i < plan->in->rows.fitted.n; i++) {
        const double *rgb = plan->in->rows.fitted.item[i].mean_rgb;
        sum += fmax(rgb[0], fmax(rgb[1], rgb[2])) / n;
    }
    double bright = fmin(fmax(sum / usual_radiance, 0.1), 5.0); /* one, where no row has been read */
    return plan->path_share * fit_s_per_path * (n > 0.0 ? pow(bright, radiance_power) : 1.0);
}

static void plan_fit(struct job_plan *plan, size_t i)
{
    char key[SPEED_BOOK_KEY_BYTES];
    /* a table ends a fit by its misfit, photographs by their noise: their shares of the expected paths differ */
    snprintf(key, sizeof key, "fit.%.40s%s%s.paths", plan->in->section.fit->method, kind_of_fit(plan),
             plan->in->section.rows->n_photograph > 0 ? "+photographs" : "+table");
    const double path_s = usual_s_per_path(plan), of_fit = plan->in->section.scan->given ? fit_share : 1.0;
    const double n_path = pipeline_plan_usual_paths(plan) * (double)plan->in->n_model;
    const struct job_clock_work work = {.key = key,
                                        .units = n_path * path_s / fit_s_per_path / n_thread(plan),
                                        .usual_s = fit_s_per_path / of_fit,
                                        .log_sd = sd_of_fit,
                                        .predicts_end = true};
    worker_status_plan(plan->status, i, &work);
    plan->fit_path = fmax(n_path / of_fit, 1.0);
}

/* Seconds that a path has taken in this job's fits; NaN before their end. */
static double s_per_path(const struct job_plan *plan)
{
    const struct model_fit *fits = plan->fit->model;
    double n = 0.0, s = 0.0;
    for (size_t i = 0; i < plan->in->n_model && fits != NULL; i++) {
        n += (double)fits[i].result.n_path;
        s += fits[i].result.wall_s;
    }
    return n > 0.0 && s > 0.0 ? s / n : NAN;
}

/* Returns the best model so far: before the validation, its errors count as 0. */
static size_t best_model(const struct job_plan *plan)
{
    static const struct validation none;
    struct pipeline_model view[JOB_MAX_MODEL];
    for (size_t i = 0; i < plan->in->n_model; i++)
        view[i] = (struct pipeline_model){.setup = &plan->in->model[i],
                                          .fit = &plan->fit->model[i],
                                          .validation =
                                              plan->validation->model != NULL ? &plan->validation->model[i] : &none};
    return pipeline_best_model(view, plan->in->n_model);
}

/* Paths of a model's fit: of the best one after the fit, before it those that are expected. */
static double fit_paths(const struct job_plan *plan)
{
    const double n_model = (double)plan->in->n_model, of_fit = plan->in->section.scan->given ? fit_share : 1.0;
    if (isfinite(s_per_path(plan))) return (double)plan->fit->model[best_model(plan)].result.n_path;
    return of_fit * plan->fit_path / n_model;
}

static double validation_paths(const struct job_plan *plan)
{
    const double n_fit = fit_paths(plan);
    return validated_path * (double)plan->in->n_model *
           (pipeline_validation_paths(plan->in->section.fit, n_fit) +
            pipeline_factor_paths(plan->in->section.fit, n_fit) + pipeline_pilot_paths(n_fit));
}

/* Time of a path on all threads: by the fits of this job, or as usual before their end. */
static double path_s_of(const struct job_plan *plan)
{
    const double own_s = s_per_path(plan);
    if (isfinite(own_s)) return own_s;
    return (plan->in->kind == JOB_OF_FIT ? usual_s_per_path(plan) : plan->path_share * render_s_per_path) /
           n_thread(plan);
}

static struct report_work_input report_input(const struct job_plan *plan)
{
    const bool fits = plan->in->kind == JOB_OF_FIT;
    return (struct report_work_input){.kind = plan->in->kind,
                                      .results = plan->in->section.results,
                                      .n_row = plan->in->rows.observation.n,
                                      .n_candidate = plan->in->section.fit->n_candidate,
                                      .n_fit_path = fits ? fit_paths(plan) : 0.0,
                                      .n_fit_path_of_models = fits ? fit_paths(plan) * (double)plan->in->n_model : 0.0,
                                      .path_s = path_s_of(plan),
                                      .n_thread = n_thread(plan),
                                      .n_voxel = plan->in->section.scan->given ? pipeline_plan_voxels(plan) : 0.0,
                                      .n_segment = n_segment(plan),
                                      .certificate_s = plan->certificate_s};
}

/* A stage after the fit, which is stage i_fit, of so many seconds by this job's speed. Before the end of the fit it
 * takes a share of the fit's time, because all of them are slow together. */
static void plan_after_fit(struct job_plan *plan, size_t i, size_t i_fit, const char *key, double seconds)
{
    const double of_fit = plan->in->section.scan->given ? fit_share : 1.0,
                 fit_s = (double)plan->in->n_model * fit_paths(plan) * path_s_of(plan) / of_fit;
    if (isfinite(s_per_path(plan)))
        worker_status_plan_own(plan->status, i, key, fmax(seconds, least_s));
    else
        worker_status_plan_share(plan->status, i, key, seconds / fit_s, i_fit);
}

/* The report of every kind of job: its parts, which the stage divides its progress by. */
static void plan_report(struct job_plan *plan, size_t i)
{
    static const char *const kind[] = {[JOB_OF_FIT] = "",
                                       [JOB_OF_GEOMETRY] = ".geometry",
                                       [JOB_OF_PICTURES] = ".cloth",
                                       [JOB_OF_PROFILE] = ".profile"};
    const struct report_work_input in = report_input(plan);
    char key[SPEED_BOOK_KEY_BYTES], parts[64];
    report_work(&in, plan->report_s);
    report_work_kind(&in, parts, sizeof parts);
    snprintf(key, sizeof key, "report%s%s", kind[plan->in->kind], parts);
    const struct job_clock_work work = {
        .key = key, .units = report_work_sum(plan->report_s), .usual_s = 1.0, .log_sd = sd_of_pictures};
    if (plan->in->kind == JOB_OF_FIT)
        plan_after_fit(plan, i, i - 2, key, work.units);
    else
        worker_status_plan(plan->status, i, &work);
}

/* Sets the time of each model's fit on one thread, too, by which the stage divides its progress. */
static void plan_profile(struct job_plan *plan, size_t i)
{
    const double rows_s = profile_evaluations * (double)plan->in->fiber.profile.n * s_per_profile_row;
    double sum_s = 1e-3;
    for (size_t k = 0; k < plan->in->n_model; k++) {
        plan->profile_s[k] = rows_s + profile_certificates * plan->model_s[k];
        sum_s += plan->profile_s[k];
    }
    const struct job_clock_work work = {
        .key = "fit.profile", .units = sum_s / n_thread(plan), .usual_s = 1.0, .log_sd = sd_of_profile};
    worker_status_plan(plan->status, i, &work);
}

void pipeline_plan_fit_paths(struct job_plan *plan, double n_path)
{
    size_t n_stage;
    const struct pipeline_stage_info *info = pipeline_stage_table(&n_stage);
    if (!(plan->stage_fraction > 0.0)) return;
    plan->fit_path = n_path / plan->stage_fraction;
    for (size_t i = 0; i < n_stage; i++)
        if (strcmp(info[i].name, "validation") == 0 || strcmp(info[i].name, "report") == 0)
            pipeline_plan_stage(plan, info[i].name, i);
}

void pipeline_plan_hollow(struct job_plan *plan, const size_t n[3])
{
    memcpy(plan->geometry.n, n, sizeof plan->geometry.n);
    const size_t i_volume = 0; /* the first of the stage table */
    plan_voxels(plan, i_volume, &hollow_stage, pipeline_plan_voxels(plan));
}

void pipeline_plan_stage(struct job_plan *plan, const char *name, size_t i)
{
    const struct job_clock_work rest = {.key = name, .units = 1.0, .usual_s = least_s, .log_sd = sd_of_rest};
    if (strcmp(name, "report") == 0)
        plan_report(plan, i);
    else if (plan->in->kind == JOB_OF_PROFILE)
        strcmp(name, "fit") == 0 ? plan_profile(plan, i) : worker_status_plan(plan->status, i, &rest);
    else if (strcmp(name, "volume") == 0)
        plan_voxels(plan, i, plan->in->section.scan->hollow_fibers > 0 ? &hollow_stage : &read_stage,
                    pipeline_plan_voxels(plan));
    else if (strcmp(name, "orientation") == 0)
        plan_voxels(plan, i, reconstruct_redirects(&plan->geometry) ? &redirect_stage : &orientation_stage,
                    n_material(plan));
    else if (strcmp(name, "fibers") == 0 && plan->in->section.scan->given)
        plan_fibers(plan, i);
    else if (strcmp(name, "fibers") == 0 && pipeline_plan_cloth_size(plan) > 0.0)
        plan_cloth(plan, i);
    else if (strcmp(name, "directions") == 0)
        plan_voxels(plan, i, &transfer_stage, n_material(plan));
    else if (strcmp(name, "fit") == 0)
        plan_fit(plan, i);
    else if (strcmp(name, "validation") == 0)
        plan_after_fit(plan, i, i - 1, name, validation_paths(plan) * path_s_of(plan));
    else
        plan_segments(plan, i, strcmp(name, "fibers") == 0 ? "fibers.given" : name);
}

void job_plan_init(struct job_plan *plan, const struct stage_tools *tools, const struct job_inputs *in)
{
    static const struct fit_output no_fit;
    static const struct validation_output no_validation;
    *plan = (struct job_plan){.tools = tools,
                              .status = tools->status,
                              .in = in,
                              .fit = &no_fit,
                              .validation = &no_validation,
                              .path_share = 1.0};
}
