#include "optimizer/stages/reading/given_result.h"
#include "base/files/foreign_json.h"
#include "base/option_id.h"
#include "optimizer/job/document/job_fit.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/job/job_folder.h"
#include "optimizer/photographs/rows/observation.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_ROW = CONFIGURATION_MAX_COUNT };
static const char *const held[] = {"rows", "discrepancy", "n_path_fit", NULL};
static const struct foreign_bounds bounds = {
    .file_bytes = (size_t)256 << 20, .held_bytes = (size_t)512 << 20, .depth = 16, .member = held};

/* The row that is read, for errors. */
struct place {
    const char *file;
    size_t row;
};

static status refuse(const struct place *at, const char *key, const char *why, struct error *err)
{
    return error_set_field(err, STATUS_FORMAT, OPTION_RESULT_FILE, "cannot use the result '%s': '%s' of row %zu %s",
                           at->file, key, at->row + 1, why);
}

static status read_number(const struct place *at, const json_t *row, const char *key, double least, double most,
                          double *out, struct error *err)
{
    const json_t *x = json_object_get(row, key);
    *out = json_is_number(x) ? json_number_value(x) : NAN;
    return *out >= least && *out <= most ? STATUS_OK : refuse(at, key, "is missing or no allowed number", err);
}

static status read_colour(const struct place *at, const json_t *row, const char *key, double rgb[3], struct error *err)
{
    const json_t *list = json_object_get(row, key);
    for (size_t c = 0; c < 3; c++) {
        const json_t *x = json_array_get(list, c);
        rgb[c] = json_is_number(x) ? json_number_value(x) : NAN;
        if (!(rgb[c] >= 0.0 && rgb[c] <= 1e6)) return refuse(at, key, "is no list of three radiances", err);
    }
    return STATUS_OK;
}

static status read_row(const struct place *at, const json_t *json, const struct job_setup *setup,
                       struct given_result *given, struct observation *row, struct error *err)
{
    double light_theta, light_phi, camera_theta, camera_phi, rotation, se[3];
    const double most_light = setup->black_sheet ? 90.0 : 180.0;
    const char *set = json_string_value(json_object_get(json, "set"));
    *row = (struct observation){.set = set != NULL && strcmp(set, "held-out") == 0 ? JOB_SET_HELD_OUT : JOB_SET_FIT,
                                .weight = 1.0};
    snprintf(row->name, sizeof row->name, "row-%zu", at->row);
    status s = read_number(at, json, "light_theta_deg", 0.0, most_light, &light_theta, err);
    if (s == STATUS_OK) s = read_number(at, json, "light_phi_deg", -360.0, 360.0, &light_phi, err);
    if (s == STATUS_OK) s = read_number(at, json, "camera_theta_deg", 0.0, 89.9, &camera_theta, err);
    if (s == STATUS_OK) s = read_number(at, json, "camera_phi_deg", -360.0, 360.0, &camera_phi, err);
    if (s == STATUS_OK) s = read_number(at, json, "cloth_rotation_deg", -360.0, 360.0, &rotation, err);
    if (s == STATUS_OK) s = read_colour(at, json, "measured", row->mean_rgb, err);
    if (s == STATUS_OK) s = read_colour(at, json, "measured_se", row->se_rgb, err);
    if (s == STATUS_OK) s = read_colour(at, json, "rendered", given->rendered_rgb[at->row], err);
    if (s == STATUS_OK) s = read_colour(at, json, "rendered_se", se, err);
    if (s != STATUS_OK) return s;
    for (int c = 0; c < 3; c++) given->rendered_var[at->row][c] = se[c] * se[c];
    row->configuration = observation_configuration(setup, light_theta, light_phi, camera_theta, camera_phi, rotation);
    if (json_is_true(json_object_get(json, "all_rotations")))
        row->configuration.n_rotation = CONFIGURATION_ALL_ROTATIONS;
    return STATUS_OK;
}

static status read_rows(const struct place *at, const json_t *rows, struct job_inputs *in, struct error *err)
{
    const size_t n = json_array_size(rows);
    struct place place = *at;
    if (!json_is_array(rows) || n > MAX_ROW)
        return error_set_field(err, STATUS_FORMAT, OPTION_RESULT_FILE,
                               "cannot use the result '%s': it has no list 'rows' of at most %d rows", at->file,
                               (int)MAX_ROW);
    in->given.rendered_rgb = calloc(n + 1, sizeof *in->given.rendered_rgb);
    in->given.rendered_var = calloc(n + 1, sizeof *in->given.rendered_var);
    if (in->given.rendered_rgb == NULL || in->given.rendered_var == NULL)
        return error_set(err, STATUS_NO_MEMORY, "cannot read the result '%s': out of memory", at->file);
    status s = STATUS_OK;
    for (; place.row < n && s == STATUS_OK; place.row++) {
        struct observation row;
        s = read_row(&place, json_array_get(rows, place.row), in->section.setup, &in->given, &row, err);
        if (s == STATUS_OK) s = observation_set_append(&in->rows.observation, &row, err);
    }
    return s;
}

/* Reads n numbers; returns whether the list has exactly these. */
static bool read_list(const json_t *list, size_t n, double *out)
{
    bool whole = json_array_size(list) == n;
    for (size_t i = 0; i < n && whole; i++) {
        const json_t *x = json_array_get(list, i);
        whole = json_is_number(x) && isfinite(json_number_value(x));
        out[i] = json_number_value(x);
    }
    return whole;
}

/* The smooth factor as result.json states it; null: the factor is 1. */
static status read_factor(const struct place *at, const json_t *json, struct discrepancy *d, struct error *err)
{
    const json_t *place = json_object_get(json, "place"), *weight = json_object_get(json, "log_weight");
    const size_t n = json_array_size(place);
    *d = (struct discrepancy){.n = 0};
    if (json == NULL || json_is_null(json)) return STATUS_OK;
    bool whole = n <= DISCREPANCY_MAX_PLACE && json_array_size(weight) == n &&
                 read_list(json_object_get(json, "scale"), DISCREPANCY_COORDINATES, d->scale);
    for (int a = 0; a < DISCREPANCY_COORDINATES; a++) whole = whole && d->scale[a] > 0.0;
    for (size_t i = 0; i < n && whole; i++)
        whole = read_list(json_array_get(place, i), DISCREPANCY_COORDINATES, d->place[i]) &&
                read_list(json_array_get(weight, i), 3, d->weight[i]);
    if (!whole)
        return error_set_field(err, STATUS_FORMAT, OPTION_RESULT_FILE,
                               "cannot use the result '%s': 'discrepancy' is no smooth factor", at->file);
    d->n = n;
    return STATUS_OK;
}

status given_result_read(const struct stage_tools *tools, struct job_inputs *in, struct error *err)
{
    char folder[WORKER_PATH_BYTES];
    const struct place at = {.file = in->section.fit->result_file};
    json_t *json = NULL;
    if (at.file[0] == '\0') return STATUS_OK;
    worker_folder_path(tools->folder, JOB_FOLDER_INPUT, NULL, folder);
    status s = foreign_json_read(folder, at.file, &bounds, &json, err);
    if (s != STATUS_OK && err != NULL) snprintf(err->field, sizeof err->field, OPTION_RESULT_FILE);
    if (s == STATUS_OK) s = read_rows(&at, json_object_get(json, "rows"), in, err);
    if (s == STATUS_OK) s = read_factor(&at, json_object_get(json, "discrepancy"), &in->given.factor, err);
    const json_t *n_path = json_object_get(json, "n_path_fit");
    if (json_is_integer(n_path) && json_integer_value(n_path) > 0)
        in->given.n_fit_path = (uint64_t)json_integer_value(n_path);
    json_decref(json);
    return s;
}

void given_result_release(struct given_result *given)
{
    free(given->rendered_rgb);
    free(given->rendered_var);
    *given = (struct given_result){.rendered_rgb = NULL};
}
