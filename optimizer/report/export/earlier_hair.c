#include "optimizer/report/export/earlier_hair.h"

#include "base/files/foreign_json.h"
#include "optimizer/job/document/job_cloth.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/job_folder.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *const held[] = {"model", "parameters", "geometry", "exports", NULL};
static const struct foreign_bounds bounds = {
    .file_bytes = (size_t)256 << 20, .held_bytes = (size_t)64 << 20, .depth = 16, .member = held};
/* Parameters are converted between units; fiber files have single precision. */
static const double param_tolerance = 1e-9, cloth_tolerance = 1e-4;

static bool read_number(const json_t *object, const char *key, double least, double most, double *out)
{
    const json_t *x = json_object_get(object, key);
    *out = json_is_number(x) ? json_number_value(x) : NAN;
    return *out >= least && *out <= most;
}

static bool is_near(const json_t *x, double value, double tolerance)
{
    return json_is_number(x) && fabs(json_number_value(x) - value) <= tolerance * fmax(fabs(value), 1e-6);
}

/* ---- whether the result is of this fit ---- */

static bool has_parameters(const struct export_scene *e, const json_t *result)
{
    const struct model_info *info = &e->model->setup->sets.info;
    const json_t *list = json_object_get(result, "parameters");
    const char *id = json_string_value(json_object_get(result, "model"));
    bool same = id != NULL && strcmp(id, e->model->setup->appearance.id) == 0 && json_array_size(list) == info->n_param;
    for (size_t p = 0; p < info->n_param && same; p++) {
        const json_t *own = json_array_get(list, p);
        const char *name = json_string_value(json_object_get(own, "name"));
        same = name != NULL && strcmp(name, info->param[p].name) == 0 &&
               is_near(json_object_get(own, "value"),
                       param_to_file_unit(&info->param[p], e->model->fit->result.param[p]), param_tolerance);
    }
    return same;
}

static bool has_cloth(const struct export_scene *e, const json_t *result)
{
    const struct fiber_set *f = &e->report->in.made->fiber;
    const json_t *geometry = json_object_get(result, "geometry"), *tile = json_object_get(geometry, "tile_mm");
    const double mm = 1e3, um = 1e6;
    double radius = 0.0;
    for (size_t i = 0; i < f->n_fiber; i++) radius += (double)f->radius_m[i] / (double)f->n_fiber;
    return is_near(json_object_get(geometry, "n_fiber"), (double)f->n_fiber, 0.0) &&
           is_near(json_object_get(geometry, "n_vertex"), (double)f->n_vertex, 0.0) &&
           is_near(json_array_get(tile, 0), mm * f->tile_size_m[0], cloth_tolerance) &&
           is_near(json_array_get(tile, 1), mm * f->tile_size_m[1], cloth_tolerance) &&
           is_near(json_object_get(geometry, "mean_radius_um"), um * radius, cloth_tolerance);
}

/* ---- the materials ---- */

static bool read_lobes(const json_t *json, struct hair_lobes *l, double *share)
{
    const json_t *absorption = json_object_get(json, "absorption");
    bool whole = read_number(json, "share", 0.0, 1.0, share) &&
                 read_number(json, "longitudinal_roughness", 1e-3, 1.0, &l->longitudinal_roughness) &&
                 read_number(json, "azimuthal_roughness", 1e-3, 1.0, &l->azimuthal_roughness) &&
                 read_number(json, "index", 1.0, 4.0, &l->index) && json_array_size(absorption) == 3;
    for (size_t c = 0; c < 3 && whole; c++) {
        const json_t *x = json_array_get(absorption, c);
        l->absorption[c] = json_is_number(x) ? json_number_value(x) : NAN;
        whole = l->absorption[c] >= 0.0 && l->absorption[c] < 1e3;
    }
    return whole;
}

static bool read_blends(const struct export_scene *e, const json_t *materials, struct hair_blend *blend)
{
    const size_t n = e->model->setup->sets.n_set;
    bool whole = json_array_size(materials) == n;
    for (size_t g = 0; g < n && whole; g++) {
        const json_t *material = json_array_get(materials, g), *hair = json_object_get(material, "hair");
        const char *group = json_string_value(json_object_get(material, "group"));
        double share[HAIR_FIT_N_BLEND] = {0};
        whole = json_array_size(hair) == HAIR_FIT_N_BLEND &&
                (n == 1 || (group != NULL && strcmp(group, e->report->in.job->cloth->group[g]) == 0));
        for (size_t k = 0; k < HAIR_FIT_N_BLEND && whole; k++)
            whole = read_lobes(json_array_get(hair, k), &blend[g].lobes[k], &share[k]);
        whole = whole && fabs(share[0] + share[1] - 1.0) < 1e-6;
        blend[g].second_share = share[1];
    }
    return whole;
}

/* An error without the deviation of the program that it contains. */
static double without(double error, double deviation) { return sqrt(fmax(error * error - deviation * deviation, 0.0)); }

/* row_error: as many as the job has rows. */
static bool read_error(const struct export_scene *e, const json_t *json, struct hair_error *h, double *row_error)
{
    const json_t *list = json_object_get(json, "row_rel_errors");
    const size_t n = e->report->in.job->rows->observation.n;
    const double deviation = json_number_value(json_object_get(json, "program_deviation"));
    bool whole = json_array_size(list) == n && read_number(json, "rel_rms", 0.0, HUGE_VAL, &h->rel_rms) &&
                 read_number(json, "row_rel_rms", 0.0, HUGE_VAL, &h->row_rel_rms) &&
                 read_number(json, "row_rel_rms_se", 0.0, HUGE_VAL, &h->row_rel_rms_se);
    for (size_t i = 0; i < n && whole; i++) {
        const json_t *x = json_array_get(list, i);
        whole = json_is_number(x) && json_number_value(x) >= 0.0;
        row_error[i] = without(json_number_value(x), deviation);
    }
    h->rel_rms = without(h->rel_rms, deviation);
    h->row_rel_rms = without(h->row_rel_rms, deviation);
    return whole;
}

/* Takes the first export of the list that states its hair and its error as a whole. */
static status take(struct export_scene *e, const json_t *exports, bool *found, struct error *err)
{
    struct hair_blend *blend = calloc(SCATTERING_MAX_SET, sizeof *blend);
    double *row_error = calloc(e->report->in.job->rows->observation.n, sizeof *row_error);
    struct hair_error h = {.stated = true};
    const json_t *json;
    size_t i;
    if (blend == NULL || row_error == NULL) {
        free(blend);
        free(row_error);
        return error_set(err, STATUS_NO_MEMORY, "cannot read the hair of an earlier export: out of memory");
    }
    json_array_foreach(exports, i, json)
    {
        *found = read_blends(e, json_object_get(json, "materials"), blend) && read_error(e, json, &h, row_error);
        if (*found) break;
    }
    for (size_t g = 0; g < e->model->setup->sets.n_set && *found; g++) e->hair[g].blend = blend[g];
    if (*found) {
        h.row_rel_error = row_error;
        e->hair_error = h;
    } else
        free(row_error);
    free(blend);
    return STATUS_OK;
}

status earlier_hair_read(struct export_scene *e, bool *found, struct error *err)
{
    const char *file = e->report->in.job->fit->result_file;
    char folder[WORKER_PATH_BYTES];
    json_t *result = NULL;
    *found = false;
    if (file[0] == '\0') return STATUS_OK;
    worker_folder_path(e->report->in.job->tools->folder, JOB_FOLDER_INPUT, NULL, folder);
    status s = foreign_json_read(folder, file, &bounds, &result, err);
    if (s == STATUS_OK && has_parameters(e, result) && has_cloth(e, result))
        s = take(e, json_object_get(result, "exports"), found, err);
    json_decref(result);
    return s;
}
