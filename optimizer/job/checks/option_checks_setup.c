/* Checks of the set-up, of the measurements, and of the document as a whole. */
#include "base/catalogue/model_catalogue.h"
#include "optimizer/job/checks/option_checks.h"
#include "optimizer/job/document/fiber_composition.h"
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_photograph.h"
#include "optimizer/job/document/job_profile.h"
#include "optimizer/job/document/job_rows.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/job/document/json_field.h"
#include "optimizer/job/document/picture_words.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

status job_check_sample(const struct option_value *v, struct error *err)
{
    size_t n = 0;
    for (const char *p = v->section->cloth->sample; *p != '\0'; p++)
        if (((unsigned char)*p & 0xC0) != 0x80) n++;
    if (n > 200)
        return error_set_field(err, STATUS_INVALID, v->path, "'sample' has %zu characters: allowed are 1 to 200", n);
    return STATUS_OK;
}

status job_check_composition(const struct option_value *v, struct error *err)
{
    struct fiber_composition unused;
    struct error why = {0};
    if (fiber_composition_read(v->section->cloth->composition, &unused, &why) == STATUS_OK) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, v->path, "'%s': %s", v->path, why.text);
}

status job_check_job_id(const struct option_value *v, struct error *err)
{
    const char *id = v->target;
    size_t n = strspn(id, "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-");
    if (n > 0 && id[n] == '\0') return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, v->path, "'%s' is '%s', which is not the id of a job", v->path, id);
}

status job_check_lamp(const struct option_value *v, struct error *err)
{
    if (v->section->setup->lamp_directional ||
        v->section->setup->lamp_side_cm <= 2.0 * v->section->setup->lamp_distance_cm)
        return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, "lamp.side_cm",
                           "'lamp.side_cm' is %g: allowed is at most twice lamp.distance_cm (%g)",
                           v->section->setup->lamp_side_cm, v->section->setup->lamp_distance_cm);
}

status job_check_camera(const struct option_value *v, struct error *err)
{
    if (v->section->setup->camera_far_field || v->section->setup->crop_cm <= v->section->setup->camera_distance_cm)
        return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, "camera.crop_cm",
                           "'camera.crop_cm' is %g: allowed is at most camera.distance_cm (%g)",
                           v->section->setup->crop_cm, v->section->setup->camera_distance_cm);
}

/* Returns whether the option belongs to a photograph of a cylinder, which lamps from below light at its sides. */
static bool is_on_cylinder(const struct option_value *v)
{
    if (strncmp(v->path, "photographs[", strlen("photographs[")) != 0) return false;
    const struct job_photograph *p = v->own;
    return p->cylinder.radius_mm > 0.0;
}

/* A lamp behind the cloth lights it through; that needs a cloth without its black sheet. */
status job_check_light_theta(const struct option_value *v, struct error *err)
{
    double theta_deg = *(const double *)v->target;
    if (is_on_cylinder(v)) return STATUS_OK;
    if (theta_deg < 90.0 || (theta_deg > 90.0 && !v->section->setup->black_sheet)) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, v->path,
                           "'%s' is %g: allowed are 0 to below 90 degrees from the normal (above 90, from behind, "
                           "without black_sheet)",
                           v->path, theta_deg);
}

status job_check_crop_px(const struct option_value *v, struct error *err)
{
    const size_t *crop = v->target;
    if (crop[2] > crop[0] && crop[3] > crop[1]) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, v->path,
                           "'%s' is empty: the order is x0, y0, x1, y1 with x0 < x1 and y0 < y1", v->path);
}

status job_check_color(const struct option_value *v, struct error *err)
{
    struct job_setup *setup = v->own;
    setup->chart.scale = setup->white.scale = 1.0;
    if (setup->has_chart != setup->has_white) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, v->path,
                           setup->has_chart ? "'%s' has both 'chart' and 'white': give one of them"
                                            : "'%s' needs 'chart' or 'white'",
                           v->path);
}

status job_check_measured_rows(const struct option_value *v, struct error *err)
{
    for (size_t i = 0; i < v->section->rows->n_measured_row; i++)
        if (v->section->rows->measured_row[i].set == JOB_SET_FIT) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, v->path,
                           "'%s' has no configuration with \"set\": \"fit\": give at least one", v->path);
}

/* Whether both angles of a lamp or camera are given, or neither; *given says which. */
static status check_angles(const char *list, size_t i, const char *what, const double angle[2], bool *given,
                           struct error *err)
{
    static const char *const name[] = {"theta_deg", "phi_deg"};
    char path[JSON_PATH_BYTES];
    *given = !isnan(angle[0]) || !isnan(angle[1]);
    for (size_t k = 0; k < 2 && *given; k++) {
        if (!isnan(angle[k])) continue;
        snprintf(path, sizeof path, "%s[%zu].%s_%s", list, i, what, name[k]);
        return error_set_field(err, STATUS_INVALID, path, "'%s' is missing: the other angle is given", path);
    }
    return STATUS_OK;
}

/* Where a lamp or camera is: by a view of the rig, by angles, or by a position, from which the angles are made. */
static status check_place(const struct option_value *v, size_t i, const char *what, double *theta_deg, double *phi_deg,
                          const double position_mm[3], double *distance_cm, struct error *err)
{
    char path[JSON_PATH_BYTES];
    bool angles, position = !isnan(position_mm[0]), view = v->section->rows->photograph[i].view[0] != '\0';
    status s = check_angles(v->path, i, what, (double[2]){*theta_deg, *phi_deg}, &angles, err);
    if (s != STATUS_OK) return s;
    snprintf(path, sizeof path, "%s[%zu].%s_%s", v->path, i, what, position ? "position_mm" : "theta_deg");
    if (angles + position + view > 1)
        return error_set_field(err, STATUS_INVALID, path, "'%s' is given as well as %s: give one of them", path,
                               view ? "'view'" : "angles");
    if (angles + position + view == 0 && what[0] == 'c' && v->section->setup->rig_file[0] != '\0')
        return STATUS_OK; /* the camera follows from the markers of the rig */
    if (angles + position + view == 0)
        return error_set_field(err, STATUS_INVALID, path,
                               "'%s' is missing: give both angles, '%s_position_mm', or a 'view' of the rig", path,
                               what);
    *distance_cm = NAN;
    if (!position) return STATUS_OK;
    job_angles_of_position(position_mm, theta_deg, phi_deg, distance_cm);
    bool camera = what[0] == 'c', cylinder = v->section->rows->photograph[i].cylinder.radius_mm > 0.0,
         behind = !camera && *theta_deg > 90.0 && (cylinder || !v->section->setup->black_sheet);
    if (*distance_cm >= 1.0 && (*theta_deg < (camera ? 89.999 : 90.0) || behind)) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, path, "'%s' is %s", path,
                           *distance_cm < 1.0 ? "nearer than 10 mm to the orbit center"
                                              : "not above the cloth (a lamp may be behind it without black_sheet)");
}

/* The keys of a cylinder mean nothing without its radius. */
static status check_cylinder(const struct option_value *v, const struct job_photograph *p, struct error *err)
{
    static const char *const key[] = {"cylinder_axis", "cylinder_edges_px", "cylinder_length_mm", "cylinder_step_deg",
                                      "cylinder_limit_deg"};
    char path[JSON_PATH_BYTES];
    for (size_t k = 0; k < sizeof key / sizeof *key && isnan(p->cylinder.radius_mm); k++) {
        if (json_object_get(json_array_get(v->value, p->index), key[k]) == NULL) continue;
        snprintf(path, sizeof path, "%s[%zu].%s", v->path, p->index, key[k]);
        return error_set_field(err, STATUS_INVALID, path,
                               "'%s' needs 'cylinder_radius_mm': the cloth is flat without it", path);
    }
    return STATUS_OK;
}

status job_check_photographs(const struct option_value *v, struct error *err)
{
    struct job_rows *rows = v->own;
    bool fitted = false;
    for (size_t i = 0; i < rows->n_photograph; i++) {
        struct job_photograph *p = &rows->photograph[i];
        char path[JSON_PATH_BYTES];
        p->index = i;
        fitted = fitted || p->set == JOB_SET_FIT;
        status s = check_place(v, i, "light", &p->light_theta_deg, &p->light_phi_deg, p->light_position_mm,
                               &p->light_distance_cm, err);
        if (s == STATUS_OK)
            s = check_place(v, i, "camera", &p->camera_theta_deg, &p->camera_phi_deg, p->camera_position_mm,
                            &p->camera_distance_cm, err);
        if (s == STATUS_OK) s = check_cylinder(v, p, err);
        if (s != STATUS_OK) return s;
        if (p->view[0] == '\0' || v->section->setup->rig_file[0] != '\0') continue;
        snprintf(path, sizeof path, "%s[%zu].view", v->path, i);
        return error_set_field(err, STATUS_INVALID, path, "'%s' needs 'rig': the file that describes the views", path);
    }
    if (fitted) return STATUS_OK;
    return error_set_field(err, STATUS_INVALID, v->path,
                           "'%s' has no photograph with \"set\": \"fit\": give at least one", v->path);
}

/* ---- the document ---- */

static bool given(const struct option_value *document, const char *key)
{
    return json_object_get(document->value, key) != NULL;
}

static status check_one_cloth(const struct option_value *v, struct error *err)
{
    static const char *const key[] = {"volume", "geometry", "fibers", "cloth"};
    const char *first = NULL;
    for (size_t i = 0; i < sizeof key / sizeof *key; i++) {
        if (!given(v, key[i])) continue;
        if (first != NULL)
            return error_set_field(err, STATUS_INVALID, key[i], "'%s' and '%s' are both given: a job takes one of them",
                                   first, key[i]);
        first = key[i];
    }
    if (first != NULL) return STATUS_OK;
    return error_set_field(
        err, STATUS_INVALID, "volume",
        "'volume' is missing: give a scan ('volume'), the geometry of another job ('geometry'), a fiber "
        "file ('fibers') or a description ('cloth')");
}

/* Of a job without photographs and measurements: it ends with the geometry of a scan, or shows given parameters. */
static status check_no_measurement(const struct option_value *v, struct error *err)
{
    static const char missing[] = "'photographs' is missing: ";
    bool pictures = json_is_array(json_object_get(v->value, "pictures")) || v->section->fit->result_file[0] != '\0';
    if (!given(v, "volume") && !pictures)
        return error_set_field(err, STATUS_INVALID, "photographs",
                               "%sgive a list of photographs, or 'measurements' with a table", missing);
    if (given(v, "correction") || (given(v, "fit") && !pictures))
        return error_set_field(err, STATUS_INVALID, "photographs",
                               "%s'%s' is given, so the job fits, and needs a list of photographs, or 'measurements' "
                               "with a table; without all of them the job ends with the geometry of the scan",
                               missing, given(v, "correction") ? "correction" : "fit");
    return STATUS_OK;
}

static status check_one_measurement(const struct option_value *v, struct error *err)
{
    if (given(v, "measurements") && given(v, "photographs"))
        return error_set_field(err, STATUS_INVALID, "photographs",
                               "'measurements' and 'photographs' are both given: a job takes one of them");
    return given(v, "measurements") || given(v, "photographs") ? STATUS_OK : check_no_measurement(v, err);
}

/* Pictures without a fit show the parameters that the document holds fixed. */
static status check_values_shown(const struct option_value *v, struct error *err)
{
    const struct job_fit *fit = v->section->fit;
    const struct job_model *m = &fit->model[0];
    struct model_sets sets;
    if (!given(v, "fit"))
        return error_set_field(err, STATUS_INVALID, "pictures",
                               "'pictures' needs 'photographs' or 'measurements', to which a model is fitted, or its "
                               "parameters: give 'fit.model' and 'fit.fixed'");
    if (fit->n_model > 1)
        return error_set_field(err, STATUS_INVALID, "fit.models",
                               "'fit.models' has %zu models, but pictures without photographs show one: give "
                               "'fit.model'",
                               fit->n_model);
    if (fit->fit_radius || fit->fit_density)
        return error_set_field(err, STATUS_INVALID, fit->fit_radius ? "fit.fit_radius" : "fit.fit_density",
                               "'%s' needs photographs", fit->fit_radius ? "fit.fit_radius" : "fit.fit_density");
    const struct job_cloth *cloth = v->section->cloth;
    const struct model_info *info = model_catalogue_find(m->id);
    status s = model_sets_init(&sets, info, cloth->group, cloth->n_group, err);
    if (s != STATUS_OK) return s;
    if (m->first_free >= 0)
        return error_set_field(err, STATUS_INVALID, "fit.fixed",
                               "'fit.fixed' lacks '%s': pictures without photographs show the values that it has for "
                               "every parameter of '%s'",
                               sets.info.param[m->first_free].name, m->id);
    return STATUS_OK;
}

/* A fit needs something to find. */
static status check_free(const struct option_value *v, struct error *err)
{
    const struct job_fit *fit = v->section->fit;
    if (job_sections_kind(v->section) == JOB_OF_PICTURES) return check_values_shown(v, err);
    for (size_t i = 0; i < fit->n_model; i++)
        if (fit->model[i].first_free < 0)
            return error_set_field(err, STATUS_INVALID, "fit.fixed",
                                   "'fit.fixed' and 'fit.tied' together hold every parameter of model '%s': leave at "
                                   "least one free",
                                   fit->model[i].id);
    return STATUS_OK;
}

status job_density_undetermined(bool black_sheet, struct error *err)
{
    return error_set_field(err, STATUS_INVALID, "fit.fit_density",
                           "'fit.fit_density' cannot be fitted: no photograph to be fitted has the lamp behind the "
                           "cloth (light_theta_deg above 90%s), and from the front brightness hardly depends on "
                           "density; add one, or give density_multiplier_per_cm",
                           black_sheet ? ", black_sheet false" : "");
}

/* Cloths of different density look alike when they are lit and seen from the front. A fit of the density therefore
 * needs light that passed through the cloth. Rows of a table are checked when the table is read. */
static status check_density(const struct job_setup *setup, const struct job_rows *rows, const struct job_fit *fit,
                            struct error *err)
{
    bool from_behind = false;
    for (size_t i = 0; i < rows->n_photograph; i++)
        if (rows->photograph[i].set == JOB_SET_FIT &&
            ((rows->photograph[i].light_theta_deg > 90.0 && !(rows->photograph[i].cylinder.radius_mm > 0.0)) ||
             rows->photograph[i].view[0] != '\0'))
            from_behind = true; /* the rig is read later */
    if (!fit->fit_density || from_behind || (rows->n_photograph == 0 && !setup->black_sheet)) return STATUS_OK;
    return job_density_undetermined(setup->black_sheet, err);
}

struct name_list {
    const char **name;
    size_t n;
};

static int compare_names(const void *a, const void *b)
{
    const char *const *x = a, *const *y = b;
    return strcmp(*x, *y);
}

static void count_name(void *context, const char *name, const char *role)
{
    (void)name, (void)role;
    ++*(size_t *)context;
}

static void collect_name(void *context, const char *name, const char *role)
{
    struct name_list *list = context;
    (void)role;
    list->name[list->n++] = name;
}

/* The error of a file that the document names twice; it names the last of the two keys. */
static status named_twice(const struct job_sections *section, const char *name, struct error *err)
{
    char path[JSON_PATH_BYTES];
    job_sections_file_key(section, name, path, sizeof path);
    return error_set_field(err, STATUS_INVALID, path,
                           "'%s' names the file '%s' a second time: each input file has one use", path, name);
}

static status check_files(const struct job_sections *section, struct error *err)
{
    status s = STATUS_OK;
    struct name_list list = {0};
    job_sections_visit_files(section, count_name, &list.n);
    list.name = malloc((list.n + 1) * sizeof *list.name);
    if (list.name == NULL) return error_set(err, STATUS_NO_MEMORY, "cannot check the job document: out of memory");
    list.n = 0;
    job_sections_visit_files(section, collect_name, &list);
    qsort(list.name, list.n, sizeof *list.name, compare_names);
    for (size_t i = 1; i < list.n && s == STATUS_OK; i++)
        if (strcmp(list.name[i - 1], list.name[i]) == 0) s = named_twice(section, list.name[i], err);
    free(list.name);
    return s;
}

status job_check_document(const struct option_value *v, struct error *err)
{
    const bool of_profile = job_profile_given(v->section->profile);
    status s = of_profile ? job_check_profile_document(v, err) : check_one_cloth(v, err);
    if (s == STATUS_OK && !of_profile) s = check_one_measurement(v, err);
    if (s == STATUS_OK) s = check_free(v, err);
    if (s == STATUS_OK) s = check_density(v->section->setup, v->section->rows, v->section->fit, err);
    return s == STATUS_OK ? check_files(v->section, err) : s;
}
