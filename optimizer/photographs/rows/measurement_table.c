#include "optimizer/photographs/rows/measurement_table.h"
#include "base/option_id.h"
#include "optimizer/job/document/job_file_name.h"
#include "optimizer/job/document/job_setup.h"
#include "optimizer/photographs/rows/number_table.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_ROW = CONFIGURATION_MAX_COUNT };

enum column {
    COLUMN_SET,
    COLUMN_LIGHT_THETA,
    COLUMN_LIGHT_PHI,
    COLUMN_CAMERA_THETA,
    COLUMN_CAMERA_PHI,
    COLUMN_R,
    COLUMN_G,
    COLUMN_B,
    COLUMN_N_REQUIRED,
    COLUMN_ROTATION = COLUMN_N_REQUIRED,
    COLUMN_R_SE,
    COLUMN_G_SE,
    COLUMN_B_SE,
    COLUMN_WEIGHT,
    COLUMN_INDEX,
    COLUMN_NAME,
    COLUMN_COUNT
};

static const char *const column_name[COLUMN_COUNT + 1] = {"set",
                                                          "light_theta_deg",
                                                          "light_phi_deg",
                                                          "camera_theta_deg",
                                                          "camera_phi_deg",
                                                          "r",
                                                          "g",
                                                          "b",
                                                          "cloth_rotation_deg",
                                                          "r_se",
                                                          "g_se",
                                                          "b_se",
                                                          "weight",
                                                          "index",
                                                          "name",
                                                          NULL};

struct table {
    const struct job_setup *setup;
    struct observation_set *rows;
    /* of the rows so far, fitted and held-out ones, which are traced together in the validation */
    size_t n_configuration;
};

/* Reads the rotation. "all" in place of the angle: the row is a mean over all rotations of the cloth. */
static status cell_rotation(const struct number_table *t, double *out_deg, uint32_t *n_rotation, struct error *err)
{
    bool all = strcmp(number_table_text(t, COLUMN_ROTATION), "all") == 0;
    *out_deg = 0.0;
    *n_rotation = all ? CONFIGURATION_ALL_ROTATIONS : 0;
    return all ? STATUS_OK : number_table_angle(t, COLUMN_ROTATION, -360.0, 360.0, out_deg, err);
}

static status cell_polar(const struct number_table *t, enum column c, bool may_be_behind, double *out,
                         struct error *err)
{
    status s = number_table_number(t, c, 0.0, out, err);
    if (s != STATUS_OK) return s;
    if (*out >= 0.0 && (*out < 90.0 || (may_be_behind && *out > 90.0 && *out <= 180.0))) return STATUS_OK;
    return number_table_error(t, STATUS_INVALID,
                              "column '%s' is %g degrees: allowed are 0 to below 90 degrees from the normal", t->file,
                              t->line, column_name[c], *out);
}

/* Names a row: the name given, with '_' for bytes that a file name cannot have, because pictures are named after
 * rows; without one "fit-03". */
static void row_name(const struct number_table *t, const struct observation_set *o, struct observation *item)
{
    const char *given = number_table_text(t, COLUMN_NAME), *kind = item->set == JOB_SET_FIT ? "fit" : "held-out";
    if (given[0] == '\0')
        snprintf(item->name, sizeof item->name, "%s-%02zu", kind, observation_set_count(o, item->set));
    else
        job_file_name_make_valid(given, item->name);
}

static status count_configurations(const struct number_table *t, struct table *rows, uint32_t n_rotation,
                                   struct error *err)
{
    rows->n_configuration += n_rotation > 1 ? n_rotation : 1;
    if (rows->n_configuration <= CONFIGURATION_MAX_COUNT) return STATUS_OK;
    return number_table_error(
        t, STATUS_TOO_LARGE,
        "more than %d renderings for fitted and held-out rows together: a row with cloth_rotation_deg "
        "'all' takes %d, so at most %d such rows, any other row takes one",
        t->file, t->line, CONFIGURATION_MAX_COUNT, CONFIGURATION_ALL_ROTATIONS,
        CONFIGURATION_MAX_COUNT / CONFIGURATION_ALL_ROTATIONS);
}

static status read_row(void *context, struct number_table *t, struct error *err)
{
    struct table *rows = context;
    struct observation_set *o = rows->rows;
    if (o->n >= MAX_ROW) return number_table_error(t, STATUS_TOO_LARGE, "more than %d rows", t->file, t->line, MAX_ROW);
    struct observation item = {0};
    const char *set = number_table_text(t, COLUMN_SET);
    if (strcmp(set, "fit") == 0)
        item.set = JOB_SET_FIT;
    else if (strcmp(set, "held-out") == 0)
        item.set = JOB_SET_HELD_OUT;
    else
        return number_table_error(t, STATUS_INVALID, "column 'set' is '%.40s': allowed are fit, held-out", t->file,
                                  t->line, set);
    double light_theta, light_phi, camera_theta, camera_phi, rotation;
    uint32_t n_rotation;
    status s = cell_polar(t, COLUMN_LIGHT_THETA, !rows->setup->black_sheet, &light_theta, err);
    if (s == STATUS_OK) s = number_table_angle(t, COLUMN_LIGHT_PHI, -360.0, 360.0, &light_phi, err);
    if (s == STATUS_OK) s = cell_polar(t, COLUMN_CAMERA_THETA, false, &camera_theta, err);
    if (s == STATUS_OK) s = number_table_angle(t, COLUMN_CAMERA_PHI, -360.0, 360.0, &camera_phi, err);
    if (s == STATUS_OK) s = cell_rotation(t, &rotation, &n_rotation, err);
    if (s == STATUS_OK) s = count_configurations(t, rows, n_rotation, err);
    for (unsigned c = 0; c < 3 && s == STATUS_OK; c++) {
        s = number_table_not_negative(t, COLUMN_R + c, 0.0, 1e6, &item.mean_rgb[c], err);
        if (s == STATUS_OK) s = number_table_not_negative(t, COLUMN_R_SE + c, 0.0, 1e6, &item.se_rgb[c], err);
    }
    if (s == STATUS_OK) s = number_table_not_negative(t, COLUMN_WEIGHT, 1.0, 1e6, &item.weight, err);
    if (s != STATUS_OK) return s;
    item.configuration =
        observation_configuration(rows->setup, light_theta, light_phi, camera_theta, camera_phi, rotation);
    item.configuration.n_rotation = n_rotation;
    row_name(t, o, &item);
    return observation_set_append(o, &item, err);
}

status measurement_table_parse(const char *text, size_t n_bytes, const char *name, const struct job_setup *setup,
                               struct observation_set *o, struct error *err)
{
    struct number_table t = {
        .file = name, .option = OPTION_MEASUREMENT_FILE, .column_name = column_name, .n_required = COLUMN_N_REQUIRED};
    struct table rows = {.setup = setup, .rows = o};
    status s = number_table_read(&t, text, n_bytes, NULL, read_row, &rows, err);
    if (s == STATUS_OK && observation_set_count(o, JOB_SET_FIT) == 0)
        s = error_set_field(err, STATUS_INVALID, OPTION_MEASUREMENT_FILE,
                            "cannot use table '%s': it has no row of the set 'fit'", name);
    return s;
}
