#include "optimizer/report/result/result_json.h"
#include "base/angle.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/job/document/json_number.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/job/stage_table.h"
#include "optimizer/report/geometry/result_geometry.h"
#include "optimizer/report/result/photograph_json.h"
#include "optimizer/report/result/result_numbers.h"
#include "optimizer/report/result/result_options_json.h"
#include "optimizer/report/result/row_pictures.h"
#include "optimizer/stages/validation/pipeline_choice.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- names and exposure ---- */

static bool name_taken(picture_name *list, size_t i)
{
    for (size_t j = 0; j < i; j++)
        if (strcmp(list[i], list[j]) == 0) return true;
    return false;
}

status result_picture_names(const struct observation_set *o, picture_name **name, struct error *err)
{
    char from[JOB_MAX_NAME_BYTES];
    picture_name *list = calloc(o->n > 0 ? o->n : 1, sizeof *list);
    if (list == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot name pictures: out of memory");
    for (size_t i = 0; i < o->n; i++) {
        job_file_name_make_valid(o->item[i].name, from);
        const char *dot = strrchr(from, '.');
        const int n = (int)(dot != NULL && dot > from ? (size_t)(dot - from) : strlen(from));
        snprintf(list[i], sizeof list[i], "%.*s", n, from);
        /* A number is appended until the name is unique, because a row may already have such a name. */
        for (size_t number = i; name_taken(list, i); number += o->n)
            snprintf(list[i], sizeof list[i], "%.*s-%zu", n < 120 ? n : 120, from, number);
    }
    *name = list;
    return STATUS_OK;
}

static int compare_double(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

double result_png_exposure(const struct observation_set *o)
{
    double *v = malloc((o->n > 0 ? o->n : 1) * sizeof *v), exposure = 1.0;
    if (v == NULL || o->n == 0) {
        free(v);
        return exposure;
    }
    for (size_t i = 0; i < o->n; i++)
        v[i] = fmax(fmax(o->item[i].mean_rgb[0], o->item[i].mean_rgb[1]), o->item[i].mean_rgb[2]);
    qsort(v, o->n, sizeof *v, compare_double);
    double bright = v[(o->n - 1) * 9 / 10];
    if (bright > 0.0) exposure = 0.8 / bright;
    free(v);
    return exposure;
}

/* ---- parts ---- */

static json_t *at_bound(const struct pipeline_model *m, size_t p)
{
    if (!m->fit->result.uncertainty.at_bound[p]) return json_null();
    const struct fit_parameter *k = &m->setup->parameter[p];
    return json_string(m->fit->result.param[p] - k->lower < k->upper - m->fit->result.param[p] ? "lower" : "upper");
}

json_t *result_parameters_json(const struct pipeline_model *m)
{
    json_t *list = json_array();
    for (size_t p = 0; p < m->setup->sets.info.n_param; p++) {
        const struct param_info *info = &m->setup->sets.info.param[p];
        const struct fit_parameter *k = &m->setup->parameter[p];
        json_t *parameter =
            json_pack("{s:s, s:s?, s:s, s:s?, s:o, s:o, s:f, s:f, s:f, s:o, s:b, s:b}", "name", info->name, "meaning",
                      info->meaning, "unit", param_unit_name(info->unit), "set", info->set, "value",
                      json_number(param_to_file_unit(info, m->fit->result.param[p])), "standard_error",
                      json_number(param_to_file_unit(info, m->fit->result.uncertainty.se_param[p])), "lower",
                      param_to_file_unit(info, k->lower), "upper", param_to_file_unit(info, k->upper), "start",
                      param_to_file_unit(info, k->start), "at_bound", at_bound(m, p), "determined",
                      (int)m->fit->result.uncertainty.determined[p], "fixed", (int)k->fixed);
        if (m->fit->scan_error.direction_se_rad > 0.0)
            json_object_set_new(parameter, "standard_error_of_fibers",
                                json_number(param_to_file_unit(info, m->fit->scan_error.se_param[p])));
        result_parameter_options(m, p, parameter);
        json_array_append_new(list, parameter);
    }
    return list;
}

static json_t *correlation_json(const struct pipeline_model *m)
{
    size_t n = m->setup->sets.info.n_param;
    json_t *list = json_array();
    for (size_t p = 0; p < n; p++)
        json_array_append_new(list, json_number_list(m->fit->result.uncertainty.correlation + p * n, n, 1.0));
    return list;
}

void result_rendered_mean(const struct pipeline_model *m, size_t i, double mean[3], double se[3])
{
    struct estimate a, b;
    nuisance_show(&m->fit->result.nuisance, &m->validation->replica[0][i], &a);
    nuisance_show(&m->fit->result.nuisance, &m->validation->replica[1][i], &b);
    for (int q = 0; q < 3; q++) {
        mean[q] = 0.5 * (a.mean[q] + b.mean[q]);
        se[q] = 0.5 * sqrt(a.var[q] + b.var[q]);
    }
}

double result_row_error(const struct report *report, const struct pipeline_model *m, size_t i, double *se)
{
    struct estimate a, b;
    nuisance_show(&m->fit->result.nuisance, &m->validation->replica[0][i], &a);
    nuisance_show(&m->fit->result.nuisance, &m->validation->replica[1][i], &b);
    return objective_row_error(&report->in.job->rows->observation.item[i], &a, &b, se);
}

static void put_row_error(json_t *row, const struct report *report, const struct pipeline_model *m, size_t i)
{
    double se, error = result_row_error(report, m, i, &se);
    json_object_set_new(row, "rel_error", json_number(error));
    json_object_set_new(row, "rel_error_se", json_number(se));
}

/* The error of fitted rows that were left out in turn; null when there are too few rows. Where numbers of the cloth are
 * fitted, they are the same in all folds; the joint fit gives the same error with new numbers in each fold. */
static json_t *cross_validation_json(const struct report *report, const struct pipeline_model *m)
{
    const struct cross_validation *v = &m->fit->result.cross_validation, *joint = &m->fit->cloth.joint.cross_validation;
    if (v->n_fold == 0) return json_null();
    json_t *json =
        json_pack("{s:o, s:o, s:I, s:I}", "rel_rms", json_number(v->rel_rms), "rel_rms_se", json_number(v->rel_rms_se),
                  "n_fold", (json_int_t)v->n_fold, "n_row", (json_int_t)v->n_row);
    if (report->in.made->number.n == 0) return json;
    json_object_set_new(json, "cloth_numbers_held", json_true());
    json_object_set_new(json, "with_cloth_numbers",
                        joint->n_fold == 0 ? json_null()
                                           : json_pack("{s:o, s:o}", "rel_rms", json_number(joint->rel_rms),
                                                       "rel_rms_se", json_number(joint->rel_rms_se)));
    return json;
}

/* Adds the results of a fit and of its validation. */
static void put_fit(json_t *json, const struct report *report, const struct pipeline_model *m)
{
    uint64_t n_path = 0;
    for (size_t i = 0; i < report->in.job->rows->observation.n; i++)
        n_path += m->validation->replica[0][i].n_path + m->validation->replica[1][i].n_path;
    json_object_set_new(json, "converged", json_boolean(m->fit->result.converged));
    json_object_set_new(json, "reason", json_string(m->fit->result.reason));
    json_object_set_new(json, "reason_code", json_string(stop_reason_info(m->fit->result.stop)->id));
    json_object_set_new(json, "parameters", result_parameters_json(m));
    json_object_set_new(json, "correlation", correlation_json(m));
    json_object_set_new(json, "objective", json_number(m->validation->fit.value));
    json_object_set_new(json, "objective_se", json_number(m->validation->fit.se));
    json_object_set_new(json, "fit_rel_rms", json_number(m->validation->fit.rel_rms));
    json_object_set_new(json, "fit_rel_rms_se", json_number(m->validation->fit.rel_rms_se));
    json_object_set_new(json, "heldout_rel_rms", json_number(m->validation->held_out.rel_rms));
    json_object_set_new(json, "heldout_rel_rms_se", json_number(m->validation->held_out.rel_rms_se));
    json_object_set_new(json, "fit_channel_rel_rms", json_number_list(m->validation->fit_channels.rel_rms, 3, 1.0));
    json_object_set_new(json, "fit_channel_rel_rms_se",
                        json_number_list(m->validation->fit_channels.rel_rms_se, 3, 1.0));
    json_object_set_new(json, "heldout_channel_rel_rms",
                        json_number_list(m->validation->held_out_channels.rel_rms, 3, 1.0));
    json_object_set_new(json, "heldout_channel_rel_rms_se",
                        json_number_list(m->validation->held_out_channels.rel_rms_se, 3, 1.0));
    json_object_set_new(json, "cross_validation", cross_validation_json(report, m));
    json_object_set_new(json, "misfit_rel_rms", json_number(sqrt(m->fit->result.uncertainty.misfit_var)));
    json_object_set_new(json, "validation_worst_rel_se", json_number(m->validation->worst_rel_se));
    result_fit_options(report, m, json);
    result_numbers_put(json, report, m);
    json_object_set_new(json, "n_path_fit", json_integer((json_int_t)m->fit->result.n_path));
    json_object_set_new(json, "n_step", json_count(m->fit->result.n_step));
    json_object_set_new(json, "fit_wall_s", json_number(m->fit->result.wall_s));
    json_object_set_new(json, "n_path_validation", json_integer((json_int_t)n_path));
}

/* One entry of "models". */
static json_t *model_json(const struct report *report, size_t i_model)
{
    const struct pipeline_model *m = &report->model[i_model];
    bool surface = m->setup->appearance.kind == MODEL_SURFACE;
    json_t *json =
        json_pack("{s:s, s:s, s:s, s:b}", "id", m->setup->appearance.id, "title", m->setup->appearance.title, "kind",
                  surface ? "surface" : "volume", "best", (int)(i_model == report_best_model(report)));
    json_t *rows = json_array();
    put_fit(json, report, m);
    for (size_t i = 0; i < report->in.job->rows->observation.n; i++) {
        double mean[3], se[3];
        result_rendered_mean(m, i, mean, se);
        json_t *row = json_pack("{s:o, s:o}", "rendered", json_number_list(mean, 3, 1.0), "rendered_se",
                                json_number_list(se, 3, 1.0));
        put_row_error(row, report, m, i);
        result_row_options(report, m, i, row);
        json_array_append_new(rows, row);
    }
    json_object_set_new(json, "rows", rows);
    return json;
}

static json_t *row_json(const struct report *report, const struct pipeline_model *m, size_t i, picture_name *picture)
{
    const struct observation *o = &report->in.job->rows->observation.item[i];
    const struct configuration *k = &o->configuration;
    const double deg = DEG_PER_RAD;
    double rendered[3], se[3];
    result_rendered_mean(m, i, rendered, se);
    json_t *row = json_pack("{s:s, s:s, s:f, s:f, s:f, s:f, s:f, s:f}", "name", o->name, "set",
                            o->set == JOB_SET_FIT ? "fit" : "held-out", "light_theta_deg", k->light_theta_rad * deg,
                            "light_phi_deg", k->light_phi_rad * deg, "camera_theta_deg", k->camera_theta_rad * deg,
                            "camera_phi_deg", k->camera_phi_rad * deg, "cloth_rotation_deg",
                            k->cloth_rotation_rad * deg, "weight", o->weight);
    json_object_set_new(row, "all_rotations", json_boolean(k->n_rotation > 1));
    json_object_set_new(row, "measured", json_number_list(o->mean_rgb, 3, 1.0));
    json_object_set_new(row, "measured_se", json_number_list(o->se_rgb, 3, 1.0));
    json_object_set_new(row, "rendered", json_number_list(rendered, 3, 1.0));
    json_object_set_new(row, "rendered_se", json_number_list(se, 3, 1.0));
    put_row_error(row, report, m, i);
    row_pictures_put(report, picture[row_pictures_shown(report, i)], picture[i], row);
    if (o->photograph.info.format != NULL)
        json_object_set_new(row, "photograph", photograph_record_json(&o->photograph));
    if (o->column.number > 0)
        json_object_set_new(row, "column",
                            photograph_column_json(report->in.photographs->photograph[i].file, &o->column));
    result_row_options(report, m, i, row);
    return row;
}

static json_t *stages_json(const struct report *report)
{
    size_t n_stage;
    const struct pipeline_stage_info *info = pipeline_stage_table(&n_stage);
    json_t *list = json_array();
    for (size_t i = 0; i < n_stage; i++)
        json_array_append_new(
            list, json_pack("{s:s, s:o}", "name", info[i].name, "wall_s", json_number(report->in.stage_wall_s[i])));
    return list;
}

/* The search for the fiber radius; null when the job did not ask for it. */
static json_t *radius_json(const struct report *report)
{
    const struct fitted_radius *r = report->in.radius;
    const double um = 1e6;
    if (!report->in.job->fit->fit_radius) return json_null();
    json_t *curve = json_array();
    for (size_t i = 0; i < r->curve.n_point; i++) {
        const struct noisy_point *p = &r->curve.point[i];
        json_array_append_new(curve, json_pack("{s:o, s:o, s:o}", "radius_um", json_number(exp(p->u) * um), "objective",
                                               json_number(p->f), "objective_se", json_number(p->se)));
    }
    return json_pack("{s:s, s:o, s:o, s:o, s:o, s:o, s:o, s:b, s:b, s:I, s:o, s:o}", "model",
                     report->model[r->i_model].setup->appearance.id, "start_um", json_number(r->start_m * um),
                     "radius_um", json_number(r->radius_m * um), "minimum_um", json_number(exp(r->curve.u) * um),
                     "standard_error_um", json_number(r->se_m * um), "lower_um", json_number(r->lower_m * um),
                     "upper_um", json_number(r->upper_m * um), "determined", (int)r->curve.determined, "at_bound",
                     (int)r->curve.at_bound, "n_path", (json_int_t)r->n_path, "wall_s", json_number(r->wall_s), "curve",
                     curve);
}

static json_t *skill_json(const struct report *report)
{
    const struct plain_brdf *b = &report->skill.brdf;
    double twin = report->model[report_best_model(report)].validation->held_out.rel_rms;
    if (!report->skill.measured) return json_null();
    json_t *plain =
        json_pack("{s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:f, s:f, s:f, s:s}", "fit_rel_rms",
                  json_number(report->skill.fit_rel_rms), "heldout_rel_rms", json_number(report->skill.heldout_rel_rms),
                  "left_out_rel_rms", json_number(report->skill.left_out_rel_rms), "diffuse",
                  json_number_list(b->diffuse_rgb, 3, 1.0), "f0", json_number_list(b->f0_rgb, 3, 1.0), "sheen",
                  json_number_list(b->sheen_rgb, 3, 1.0), "transmission", json_number_list(b->transmission_rgb, 3, 1.0),
                  "retro", b->retro, "roughness", b->roughness, "sheen_roughness", b->sheen_roughness, "masking",
                  b->separable_masking ? "separable" : "correlated");
    return json_pack("{s:o, s:o}", "plain_brdf", plain, "heldout_ratio",
                     json_number(twin / report->skill.heldout_rel_rms));
}

/* The meaning of the figures of the file, so that it can be read alone. */
static json_t *definitions_json(void)
{
    return json_pack(
        "{s:s, s:s, s:s, s:s, s:s, s:s}", "radiance",
        "a perfect white diffuser that faces the lamp has the radiance 1; rgb, linear", "rel_error",
        "of a row: sqrt(max(0, sum over channels of (A - M)(B - M) / 3)) / max(mean of M, 0.02), M measured, A and B "
        "two "
        "independent renderings, whose noise cancels",
        "rel_rms",
        "root mean square of the rel_error of all rows of weight above 0 of a set; fit: fitted rows, heldout: "
        "rows that neither the fit nor the choice of the model has seen",
        "objective", "sum over fitted rows of weight (A - M)(B - M) / max(mean of M, 0.02)^2, all channels",
        "standard_error",
        "..._se, one standard deviation; of parameters with noise of photographs and of tracing and with "
        "the misfit, of errors by tracing alone",
        "null", "a number that does not exist");
}

/* Adds the entries of every job, also of a job of geometry only; a fiber without a cloth has no geometry. */
static void put_job(json_t *json, struct report *report)
{
    const bool of_cloth = report->in.kind != JOB_OF_PROFILE;
    json_object_set_new(json, "definitions", definitions_json());
    json_object_set_new(json, "verdict", verdict_json(&report->verdict));
    json_object_set_new(json, "geometry", of_cloth ? result_geometry_json(report) : json_null());
    json_object_set_new(json, "color",
                        of_cloth ? photograph_color_json(&report->in.job->rows->process, report->in.job->setup)
                                 : json_null());
    json_object_set_new(json, "quality",
                        of_cloth ? json_pack("{s:s, s:s}", "page", "quality.html", "numbers", "quality.json")
                                 : json_null());
    json_object_set_new(json, "stages", stages_json(report));
    json_object_set_new(json, "warnings", result_warnings_json(report));
    json_object_set(json, "files", report->in.statements);
    json_object_set_new(json, "program", json_string(RESULT_PROGRAM));
}

static json_t *result_json(struct report *report, picture_name *picture)
{
    const struct pipeline_model *best = &report->model[report_best_model(report)];
    json_t *rows = json_array(), *models = json_array();
    for (size_t i = 0; i < report->in.job->rows->observation.n; i++)
        json_array_append_new(rows, row_json(report, best, i, picture));
    for (size_t i = 0; i < report->n_model; i++) json_array_append_new(models, model_json(report, i));
    json_t *json = json_pack("{s:i, s:s, s:s, s:s, s:I}", "format", 1, "sample", report->in.sample, "model",
                             best->setup->appearance.id, "method", report->in.job->fit->method, "seed",
                             (json_int_t)report->in.job->seed);
    json_object_set_new(json, "chosen_by",
                        json_string(pipeline_choice_id(pipeline_choice(report->model, report->n_model))));
    put_fit(json, report, best);
    json_object_set_new(json, "rows", rows);
    json_object_set_new(json, "models", models);
    row_pictures_put_lobes(report, json);
    json_object_set_new(json, "skill", skill_json(report));
    json_object_set_new(json, "discrepancy", discrepancy_json(best));
    json_object_set_new(json, "radius", radius_json(report));
    json_object_set(json, "exports", report->exports);
    json_object_set(json, "pictures", report->surface_pictures);
    json_object_set_new(json, "png_exposure", json_number(result_png_exposure(&report->in.job->rows->observation)));
    put_job(json, report);
    return json;
}

/* Writes result.json, and releases json. */
static status write_result(const struct report *report, json_t *json, struct error *err)
{
    char path[WORKER_PATH_BYTES];
    char *text = json_dumps(json, JSON_REAL_PRECISION(17) | JSON_INDENT(1));
    worker_folder_path(report->in.job->tools->folder, JOB_FOLDER_RESULTS, "result.json", path);
    status s = text != NULL ? worker_folder_replace(report->in.job->tools->folder, path, text, strlen(text), err)
                            : error_set(err, STATUS_NO_MEMORY, "cannot write '%s': out of memory", path);
    free(text);
    json_decref(json);
    return s;
}

status result_json_finish(struct report *report, json_t *json, struct error *err)
{
    put_job(json, report);
    return write_result(report, json, err);
}

status result_geometry_json_write(struct report *report, struct error *err)
{
    json_t *json = json_pack("{s:i, s:s, s:n, s:n, s:[], s:[], s:[]}", "format", 1, "sample", report->in.sample,
                             "model", "method", "parameters", "rows", "models");
    return result_json_finish(report, json, err);
}

status result_pictures_json_write(struct report *report, struct error *err)
{
    const struct pipeline_model *m = report->model;
    json_t *json = json_pack("{s:i, s:s, s:s, s:n, s:o, s:[], s:[], s:I, s:O, s:O}", "format", 1, "sample",
                             report->in.sample, "model", m->setup->appearance.id, "method", "parameters",
                             result_parameters_json(m), "rows", "models", "seed", (json_int_t)report->in.job->seed,
                             "pictures", report->surface_pictures, "exports", report->exports);
    return result_json_finish(report, json, err);
}

status result_json_write(struct report *report, struct error *err)
{
    picture_name *picture = NULL;
    status s = result_picture_names(&report->in.job->rows->observation, &picture, err);
    if (s == STATUS_OK) s = write_result(report, result_json(report, picture), err);
    free(picture);
    return s;
}
