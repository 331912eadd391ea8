/* Checks of the parts of the section "fit" that do not depend on a model's parameters. */
#include "base/catalogue/method_catalogue.h"
#include "base/catalogue/model_catalogue.h"
#include "base/catalogue/picture_method.h"
#include "optimizer/job/checks/job_film.h"
#include "optimizer/job/checks/option_checks.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_fit_option.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_results.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/job/document/job_sections.h"
#include "optimizer/job/document/job_setup.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

status job_check_fit_radius(const struct option_value *v, struct error *err)
{
    const struct job_fit *fit = v->section->fit;
    if (fit->radius_upper_um < 1.1 * fit->radius_lower_um) /* false where one is NaN */
        return error_set_field(err, STATUS_INVALID, "fit.fit_radius.upper_um",
                               "'fit.fit_radius.upper_um' is %g: it must be at least 1.1 times lower_um (%g)",
                               fit->radius_upper_um, fit->radius_lower_um);
    return STATUS_OK;
}

status job_check_nuisance(const struct option_value *v, struct error *err)
{
    const struct job_fit_option *o = &v->section->fit->model[0].option;
    if (json_object_get(v->value, "gain_prior_rel") != NULL && o->gain == JOB_GAIN_NONE)
        return error_set_field(err, STATUS_INVALID, "fit.nuisance.gain_prior_rel",
                               "'fit.nuisance.gain_prior_rel' needs 'fit.nuisance.gain': no gain is fitted");
    if (json_object_get(v->value, "stray_light_prior") != NULL && !o->stray_light)
        return error_set_field(err, STATUS_INVALID, "fit.nuisance.stray_light_prior",
                               "'fit.nuisance.stray_light_prior' needs 'fit.nuisance.stray_light': no stray light is "
                               "fitted");
    if (v->section->fit->plain_prior > 0.0 && (o->gain != JOB_GAIN_NONE || o->stray_light))
        return error_set_field(err, STATUS_INVALID, v->path,
                               "'%s' cannot be used with 'fit.plain_prior': the plain BRDF does not know these faults",
                               v->path);
    if (v->section->fit->discrepancy && (o->gain != JOB_GAIN_NONE || o->stray_light))
        return error_set_field(err, STATUS_INVALID, v->path,
                               "'%s' cannot be used with 'fit.discrepancy': it would take these faults for the cloth's",
                               v->path);
    return STATUS_OK;
}

/* ---- texture ---- */

size_t job_texture_cells(double crop_cm, double block_mm) { return (size_t)lround(10.0 * crop_cm / block_mm); }

double job_texture_cell_mm(double crop_cm, double block_mm)
{
    return 10.0 * crop_cm / (double)job_texture_cells(crop_cm, block_mm);
}

/* Texture needs blocks that divide the crop, photographs (a table of means has no texture), and a method that takes
 * contrasts as terms of the objective. */
status job_check_texture(const struct option_value *v, struct error *err)
{
    const struct job_fit *fit = v->section->fit;
    double crop_mm = 10.0 * v->section->setup->crop_cm, block_mm = fit->texture_block_mm;
    if (block_mm > crop_mm / 2.0 || lround(crop_mm / block_mm) > JOB_MAX_TEXTURE_CELLS)
        return error_set_field(err, STATUS_INVALID, "fit.texture.block_mm",
                               "'fit.texture.block_mm' is %g: it must divide the crop of %g mm into 2 to %d blocks a "
                               "side, which is %g to %g mm",
                               block_mm, crop_mm, JOB_MAX_TEXTURE_CELLS, crop_mm / JOB_MAX_TEXTURE_CELLS,
                               crop_mm / 2.0);
    if (v->section->rows->measurement_file[0] != '\0')
        return error_set_field(err, STATUS_INVALID, v->path, "'%s' needs photographs: a table of means has no texture",
                               v->path);
    size_t n_flat = 0;
    for (size_t i = 0; i < v->section->rows->n_photograph; i++)
        n_flat += !job_photograph_is_cylinder(&v->section->rows->photograph[i]);
    if (v->section->rows->n_photograph > 0 && n_flat == 0)
        return error_set_field(err, STATUS_INVALID, v->path,
                               "'%s' needs a photograph of flat cloth: columns of cylinders have no texture", v->path);
    if (fit->texture_weight > 0.0 && (method_catalogue_find(fit->method)->takes & METHOD_TAKES_TEXTURE) == 0)
        return error_set_field(err, STATUS_INVALID, v->path,
                               "'%s' with a weight needs the method '%s': '%s' has no such terms", v->path,
                               method_catalogue_taking(METHOD_TAKES_TEXTURE)->id, fit->method);
    if (fit->share_camera_paths)
        return error_set_field(err, STATUS_INVALID, v->path,
                               "'%s' cannot be used with 'fit.share_camera_paths': a contrast needs paths of its own",
                               v->path);
    if (fit->model[0].option.stray_light)
        return error_set_field(err, STATUS_INVALID, v->path,
                               "'%s' cannot be used with 'fit.nuisance.stray_light': a contrast that is lowered by "
                               "stray light is not modelled",
                               v->path);
    return STATUS_OK;
}

/* ---- candidates for the next photograph ---- */

static const double light_theta[] = {20, 45, 65, 80}, camera_theta[] = {0, 30, 60, 75}, camera_phi[] = {180, 90},
                    rotation[] = {0, 90};

/* The built-in candidates: the lamp at phi 0, the camera opposite to it or beside it, the cloth turned by 0 and 90
 * degrees. Without the black sheet there are also lamps behind the cloth. */
static status make_grid(const struct job_setup *setup, struct job_fit *fit, struct error *err)
{
    enum { FRONT = 4 * 4 * 2 * 2, BACK = 4 };
    fit->candidate = calloc(FRONT + BACK, sizeof *fit->candidate);
    if (fit->candidate == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot read the job document: out of memory");
    for (size_t i = 0; i < FRONT; i++) {
        struct job_candidate c = {light_theta[i / 16], 0.0, camera_theta[i / 4 % 4], camera_phi[i / 2 % 2],
                                  rotation[i % 2]};
        if (c.camera_theta_deg == 0.0 && c.camera_phi_deg != 180.0) continue; /* from above, phi makes no difference */
        fit->candidate[fit->n_candidate++] = c;
    }
    for (size_t i = 0; i < BACK && !setup->black_sheet; i++)
        fit->candidate[fit->n_candidate++] =
            (struct job_candidate){150.0, 0.0, i / 2 ? 45.0 : 0.0, 180.0, rotation[i % 2]};
    return STATUS_OK;
}

status job_check_export(const struct option_value *v, struct error *err)
{
    const bool *wanted = v->target;
    if (!*wanted || job_sections_kind(v->section) == JOB_OF_FIT || v->section->fit->result_file[0] != '\0')
        return STATUS_OK;
    return error_set_field(
        err, STATUS_INVALID, v->path,
        "'%s' needs a fitted model: give 'photographs', 'measurements', or the result of another job "
        "as 'fit.result_file'",
        v->path);
}

status job_check_report_file(const struct option_value *v, struct error *err)
{
    if (v->section->results->report_file[0] == '\0' || v->section->fit->result_file[0] != '\0') return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, v->path,
                           "'%s' is given, but the job writes a report of its own: leave it out, or give the result of "
                           "another job as 'fit.result_file'",
                           v->path);
}

status job_check_result_file(const struct option_value *v, struct error *err)
{
    const struct job_fit *fit = v->section->fit;
    const enum job_kind kind = job_sections_kind(v->section);
    if (fit->result_file[0] == '\0' || kind == JOB_OF_PICTURES) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, v->path,
                           "'%s' is given, but the job finds parameters of its own: leave it out, or '%s'", v->path,
                           kind == JOB_OF_PROFILE               ? "profile"
                           : v->section->rows->n_photograph > 0 ? "photographs"
                                                                : "measurements");
}

/* Speckle is of path-traced pictures of models that have it, whichever of the job's models will be the best. */
static status check_speckle(const struct job_fit *fit, const struct job_results *results, size_t i, struct error *err)
{
    const struct job_surface_picture *p = &results->surface_picture[i];
    char field[64];
    if (!p->speckle) return STATUS_OK;
    snprintf(field, sizeof field, "pictures[%zu].speckle", i);
    if (p->method != JOB_PICTURE_PATH)
        return error_set_field(err, STATUS_INVALID, field, "'%s' is true, but 'method' is not \"path\"", field);
    for (size_t k = 0; k < fit->n_model; k++)
        if (!model_catalogue_has_speckle(fit->model[k].id))
            return error_set_field(err, STATUS_INVALID, field,
                                   "'%s' is true, but model '%s' has no speckle: models of waves have, such as '%s'",
                                   field, fit->model[k].id, model_catalogue_with_speckle(0));
    return STATUS_OK;
}

/* A job of several models is shown by the best one: one of them with a far field is enough. */
static status check_field(const struct job_fit *fit, const struct job_results *results, size_t i, struct error *err)
{
    char field[64];
    if (!results->surface_picture[i].field_by_pixel) return STATUS_OK;
    for (size_t k = 0; k < fit->n_model; k++)
        if (model_catalogue_far_field(fit->model[k].id) != NULL) return STATUS_OK;
    snprintf(field, sizeof field, "pictures[%zu].field_by_pixel", i);
    return error_set_field(err, STATUS_INVALID, field,
                           "'%s' is true, but model '%s' has no far field to take in its place: near fields have, such "
                           "as '%s'",
                           field, fit->model[0].id, model_catalogue_near_field(0));
}

/* Tables and walks are made in the flat cloth of the job, over its sheet. */
static status check_sheet(const struct job_setup *setup, const struct job_results *results, size_t i, struct error *err)
{
    const struct job_surface_picture *p = &results->surface_picture[i];
    char field[64];
    if (!picture_method_of_flat_cloth(p->method) || p->black_sheet < 0 || (p->black_sheet != 0) == setup->black_sheet)
        return STATUS_OK;
    snprintf(field, sizeof field, "pictures[%zu].black_sheet", i);
    return error_set_field(err, STATUS_INVALID, field,
                           "'%s' is %s and 'black_sheet' is %s: a picture of this method has the black sheet of the "
                           "job, or none like it; leave it out, or take the method path or dual",
                           field, p->black_sheet != 0 ? "true" : "false", setup->black_sheet ? "true" : "false");
}

/* Paths are refused where no table of view and light is made of them. */
static status check_deep_paths(const struct job_surface_picture *p, const json_t *given, size_t i, struct error *err)
{
    char field[64];
    const char *why = p->method != JOB_PICTURE_FAST ? "'method' is not \"fast\""
                      : p->visibility_by_tables     ? "'visibility' is \"tables\", with light from cells"
                      : p->deep_by_cells            ? "'deep_light' is \"cells\""
                                                    : NULL;
    if (why == NULL || json_object_get(given, "deep_light_paths") == NULL) return STATUS_OK;
    snprintf(field, sizeof field, "pictures[%zu].deep_light_paths", i);
    return error_set_field(err, STATUS_INVALID, field,
                           "'%s' is given, but the picture has no table of view and light: %s", field, why);
}

/* Returns whether light that is scattered often comes from cells. */
static bool by_cells(const struct job_surface_picture *p)
{
    return p->method == JOB_PICTURE_FAST && (p->visibility_by_tables || p->deep_by_cells);
}

/* All pictures with light from cells share one table, and others have none. */
static status check_cells(const struct job_results *results, const json_t *given, size_t i, struct error *err)
{
    static const char *const key[2] = {"cell_order", "cell_paths"};
    const struct job_surface_picture *p = &results->surface_picture[i];
    char field[64];
    for (int k = 0; k < 2; k++) {
        snprintf(field, sizeof field, "pictures[%zu].%s", i, key[k]);
        if (!by_cells(p)) {
            if (json_object_get(given, key[k]) == NULL) continue;
            return error_set_field(err, STATUS_INVALID, field,
                                   "'%s' is given, but the picture has no light from cells: take the method \"fast\" "
                                   "with 'deep_light' \"cells\"",
                                   field);
        }
        for (size_t j = 0; j < i; j++) {
            const struct job_surface_picture *q = &results->surface_picture[j];
            if (!by_cells(q) || (k == 0 ? p->cell_order == q->cell_order : p->cell_free_paths == q->cell_free_paths))
                continue;
            return error_set_field(err, STATUS_INVALID, field,
                                   "'%s' is another than that of 'pictures[%zu]', whose table of cells it shares",
                                   field, j);
        }
    }
    return STATUS_OK;
}

/* Returns the rays of a pixel along an axis of a preview; 0: the samples are no square, or too many. */
static size_t preview_side(size_t sample)
{
    const size_t most = 8; /* RAY_MAX_SIDE */
    for (size_t side = 1; side <= most; side++)
        if (side * side == sample) return side;
    return 0;
}

/* What a lens and a preview of the smooth surface do not go with. */
static status check_preview(const struct job_setup *setup, const struct job_surface_picture *p, const json_t *given,
                            size_t i, struct error *err)
{
    const bool sheared = p->method == JOB_PICTURE_SHEARED, lens = p->aperture_mm > 0.0;
    const struct {
        bool wrong;
        const char *key, *why;
    } row[] = {
        {lens && setup->camera_far_field, "aperture_mm", "'camera.far_field' is true: such a camera has no lens"},
        {lens && !isnan(p->ground_gap_mm), "aperture_mm", "the ground below the cloth is not seen through a lens"},
        {lens && p->filter, "filter",
         "'aperture_mm' is, too: take the method \"sheared\", which filters what a lens "
         "blurs"},
        {!lens && !isnan(p->focus_mm), "focus_mm", "there is no 'aperture_mm'"},
        {sheared && p->filter, "filter", "the method \"sheared\" filters already"},
        {sheared && preview_side(p->sample) == 0, "samples",
         "the method \"sheared\" takes a square of them, up to 64: 1, 4, 9, 16, 25, 36, 49 or 64"},
        {sheared && p->px > JOB_MAX_PREVIEW_PX, "px", "the method \"sheared\" takes at most 2048"},
        {!sheared && json_object_get(given, "preview_filter") != NULL, "preview_filter", "'method' is not \"sheared\""},
    };
    for (size_t k = 0; k < sizeof row / sizeof *row; k++) {
        char field[64];
        if (!row[k].wrong) continue;
        snprintf(field, sizeof field, "pictures[%zu].%s", i, row[k].key);
        return error_set_field(err, STATUS_INVALID, field, "'%s' is given, but %s", field, row[k].why);
    }
    return STATUS_OK;
}

/* Tables of diffusion are made over the job's sheet, which the studio does not have. */
static status check_studio_method(const struct job_surface_picture *p, size_t i, struct error *err)
{
    char field[64];
    snprintf(field, sizeof field, "pictures[%zu].%s", i, p->reference ? "reference" : "method");
    if (p->method == JOB_PICTURE_DIFFUSION || p->method == JOB_PICTURE_SHEARED)
        return error_set_field(err, STATUS_INVALID, field,
                               "'pictures[%zu].method' is \"%s\", which the studio does not have: take \"fast\", "
                               "\"path\" or \"dual\"",
                               i, picture_method_name[p->method]);
    if (p->reference && p->method == JOB_PICTURE_PATH)
        return error_set_field(err, STATUS_INVALID, field,
                               "'%s' is true, but 'method' is \"path\": such a picture is its own reference", field);
    return STATUS_OK;
}

static status check_picture(const struct job_setup *setup, const struct job_fit *fit, const struct job_results *results,
                            size_t i, struct error *err)
{
    const struct job_surface_picture *p = &results->surface_picture[i];
    bool sheet = p->black_sheet < 0 ? setup->black_sheet : p->black_sheet != 0;
    char field[64];
    if (p->kind != JOB_KIND_MEASUREMENT) return check_studio_method(p, i, err);
    snprintf(field, sizeof field, "pictures[%zu].mesh_file", i);
    if (p->on == JOB_ON_MESH && p->mesh_file[0] == '\0')
        return error_set_field(err, STATUS_INVALID, field, "'%s' is missing: the picture is to lie on a mesh", field);
    if (p->on != JOB_ON_MESH && p->mesh_file[0] != '\0')
        return error_set_field(err, STATUS_INVALID, field, "'%s' is given, but 'on' is not \"mesh\"", field);
    snprintf(field, sizeof field, "pictures[%zu].width_mm", i);
    if (!setup->camera_far_field && p->width_mm > 10.0 * setup->camera_distance_cm)
        return error_set_field(err, STATUS_INVALID, field, "'%s' is %g: allowed is at most camera.distance_cm (%g cm)",
                               field, p->width_mm, setup->camera_distance_cm);
    snprintf(field, sizeof field, "pictures[%zu].light_theta_deg", i);
    if (p->on == JOB_ON_FLAT && (p->light_theta_deg == 90.0 || (sheet && p->light_theta_deg > 90.0)))
        return error_set_field(
            err, STATUS_INVALID, field,
            "'%s' is %g: a flat piece is lit from above, below 90 degrees, or from behind, above 90, "
            "with 'black_sheet' false",
            field, p->light_theta_deg);
    snprintf(field, sizeof field, "pictures[%zu].ground_gap_mm", i);
    const double *around = setup->environment_rgb;
    if (!isnan(p->ground_gap_mm) && (p->light_theta_deg >= 90.0 || p->camera_theta_deg >= 90.0))
        return error_set_field(err, STATUS_INVALID, field,
                               "'%s' is given, but the ground under the cloth wants lamp and camera above it, below 90 "
                               "degrees from the vertical",
                               field);
    if (!isnan(p->ground_gap_mm) &&
        (setup->environment_file[0] != '\0' || around[0] > 0.0 || around[1] > 0.0 || around[2] > 0.0))
        return error_set_field(err, STATUS_INVALID, field,
                               "'%s' is given, but the ground under the cloth is lit by the lamp alone: leave out "
                               "'environment'",
                               field);
    snprintf(field, sizeof field, "pictures[%zu].reference", i);
    if (p->reference && p->method == JOB_PICTURE_PATH)
        return error_set_field(err, STATUS_INVALID, field,
                               "'%s' is true, but 'method' is \"path\": such a picture is its own reference", field);
    snprintf(field, sizeof field, "pictures[%zu].visibility", i);
    if (p->visibility_by_tables && p->method != JOB_PICTURE_FAST)
        return error_set_field(err, STATUS_INVALID, field, "'%s' is \"tables\", but 'method' is not \"fast\"", field);
    snprintf(field, sizeof field, "pictures[%zu].deep_light", i);
    if (p->deep_by_cells && p->method != JOB_PICTURE_FAST)
        return error_set_field(err, STATUS_INVALID, field, "'%s' is \"cells\", but 'method' is not \"fast\"", field);
    snprintf(field, sizeof field, "pictures[%zu].radius_mm", i);
    if (p->on == JOB_ON_DRAPE && !(p->radius_mm >= 0.02 * p->size_mm && p->radius_mm <= 10.0 * p->size_mm))
        return error_set_field(err, STATUS_INVALID, field,
                               "'%s' is %g: the ball under a draped piece of %g mm may have a radius of %g to %g mm",
                               field, p->radius_mm, p->size_mm, 0.02 * p->size_mm, 10.0 * p->size_mm);
    status s = check_sheet(setup, results, i, err);
    if (s == STATUS_OK) s = check_speckle(fit, results, i, err);
    return s == STATUS_OK ? check_field(fit, results, i, err) : s;
}

status job_check_pictures(const struct option_value *v, struct error *err)
{
    status s = STATUS_OK;
    struct job_results *own = v->own;
    for (size_t i = 0; i < v->section->results->n_surface_picture && s == STATUS_OK; i++) {
        s = job_picture_complete(json_array_get(v->value, i), i, &own->surface_picture[i], err);
        if (s == STATUS_OK) s = check_picture(v->section->setup, v->section->fit, v->section->results, i, err);
        if (s == STATUS_OK)
            s = check_deep_paths(&v->section->results->surface_picture[i], json_array_get(v->value, i), i, err);
        if (s == STATUS_OK)
            s = check_preview(v->section->setup, &v->section->results->surface_picture[i], json_array_get(v->value, i),
                              i, err);
        if (s == STATUS_OK)
            s = job_film_check_picture(v->section->cloth, &v->section->results->surface_picture[i], i, err);
        if (s == STATUS_OK) s = check_cells(v->section->results, json_array_get(v->value, i), i, err);
    }
    return s;
}

status job_check_twin(const struct option_value *v, struct error *err)
{
    const bool *wanted = v->target;
    if (!*wanted || job_sections_kind(v->section) != JOB_OF_GEOMETRY) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, v->path,
                           "'%s' needs a model with its parameters: give 'photographs', 'measurements' or 'pictures'",
                           v->path);
}

status job_check_candidates(const struct option_value *v, struct error *err)
{
    struct job_fit *fit = v->own;
    if (fit->n_candidate == 0 && !fit->candidate_grid)
        return error_set_field(err, STATUS_INVALID, v->path,
                               "'%s' has no configurations and no grid: fill it or leave it out", v->path);
    return fit->candidate_grid ? make_grid(v->section->setup, fit, err) : STATUS_OK;
}
